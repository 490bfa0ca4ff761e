#include "services/common/service/run_service.h"
#include "services/reconstruction/reconstruction_service.h"

namespace forgescan {
namespace {

Result<std::shared_ptr<void>> Make(const ServiceContext& context) {
  ASSIGN_OR_RETURN(const auto config,
                   ReconstructionServiceConfig::Load(context.station.file.Table("reconstruction")));
  ASSIGN_OR_RETURN(PatternSet pattern, LoadPatternSet(context.station.pattern));
  ASSIGN_OR_RETURN(StereoCalibration calibration, LoadStereoCalibration(context.station.calibration));
  return std::shared_ptr<void>(std::make_shared<ReconstructionService>(
      context.hub, context.monitor, config, std::move(pattern), std::move(calibration)));
}

}  // namespace
}  // namespace forgescan

int main(int argc, char** argv) {
  return forgescan::RunService("reconstruction", argc, argv, forgescan::Make);
}
