#include "services/reconstruction/make_reconstruction_service.h"

#include "services/reconstruction/reconstruction_service.h"

namespace forgescan {

Result<std::shared_ptr<void>> MakeReconstructionService(const ServiceParts& parts) {
  const Station& station = parts.station;
  ASSIGN_OR_RETURN(const auto config,
                   ReconstructionServiceConfig::Load(station.file.Table("reconstruction")));
  ASSIGN_OR_RETURN(PatternSet pattern, LoadPatternSet(station.pattern));
  ASSIGN_OR_RETURN(StereoCalibration calibration, LoadStereoCalibration(station.calibration));
  return std::shared_ptr<void>(std::make_shared<ReconstructionService>(
      parts.hub, parts.monitor, config, std::move(pattern), std::move(calibration)));
}

}  // namespace forgescan
