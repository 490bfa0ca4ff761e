#include "services/fusion/make_fusion_service.h"

#include "services/fusion/fusion_service.h"
#include "services/fusion/standing_file.h"

namespace forgescan {

namespace {

Result<std::optional<VisitCorrection>> LoadCorrection(const Station& station, const FusionConfig& config,
                                                      const ViewMatrices& matrices) {
  if (station.standing.empty()) {
    return std::optional<VisitCorrection>();
  }
  ASSIGN_OR_RETURN(const VisitErrorOptions options, VisitOptionsOf(config));
  StandingOrigin origin{matrices.path_crc32, 0};
  ASSIGN_OR_RETURN(origin.calibration_crc32, Crc32OfFile(station.calibration));
  ASSIGN_OR_RETURN(StandingSurfaces standing,
                   LoadStandingSurfaces(station.standing, origin, matrices.array_from_camera.size()));
  return std::optional<VisitCorrection>(std::in_place, std::move(standing), options);
}

}  // namespace

Result<std::shared_ptr<void>> MakeFusionService(const ServiceParts& parts) {
  ASSIGN_OR_RETURN(FusionConfig config, FusionConfig::Load(parts.station.file.Table("fusion")));
  ASSIGN_OR_RETURN(ExpansionCurve curve, ExpansionCurve::Create(config.expansion_degc, config.expansion));
  ASSIGN_OR_RETURN(ViewMatrices matrices, ViewMatrices::Load(parts.station.views));
  ASSIGN_OR_RETURN(auto correction, LoadCorrection(parts.station, config, matrices));
  FusionFiles files{std::move(matrices), std::move(curve), std::move(correction)};
  return std::shared_ptr<void>(
      std::make_shared<FusionService>(parts.hub, parts.monitor, std::move(config), std::move(files)));
}

}  // namespace forgescan
