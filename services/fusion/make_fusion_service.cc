#include "services/fusion/make_fusion_service.h"

#include "services/fusion/fusion_service.h"

namespace forgescan {

Result<std::shared_ptr<void>> MakeFusionService(const ServiceParts& parts) {
  ASSIGN_OR_RETURN(FusionConfig config, FusionConfig::Load(parts.station.file.Table("fusion")));
  ASSIGN_OR_RETURN(ExpansionCurve curve, ExpansionCurve::Create(config.expansion_degc, config.expansion));
  ASSIGN_OR_RETURN(ViewMatrices matrices, ViewMatrices::Load(parts.station.views));
  return std::shared_ptr<void>(std::make_shared<FusionService>(parts.hub, parts.monitor, std::move(config),
                                                               std::move(matrices), std::move(curve)));
}

}  // namespace forgescan
