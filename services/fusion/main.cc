#include "services/common/service/run_service.h"
#include "services/fusion/fusion_service.h"

namespace forgescan {
namespace {

Result<std::shared_ptr<void>> Make(const ServiceContext& context) {
  ASSIGN_OR_RETURN(FusionConfig config, FusionConfig::Load(context.station.file.Table("fusion")));
  ASSIGN_OR_RETURN(ExpansionCurve curve, ExpansionCurve::Create(config.expansion_degc, config.expansion));
  ASSIGN_OR_RETURN(ViewMatrices matrices, ViewMatrices::Load(context.station.views));
  return std::shared_ptr<void>(std::make_shared<FusionService>(
      context.hub, context.monitor, std::move(config), std::move(matrices), std::move(curve)));
}

}  // namespace
}  // namespace forgescan

int main(int argc, char** argv) { return forgescan::RunService("fusion", argc, argv, forgescan::Make); }
