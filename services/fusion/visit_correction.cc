#include "services/fusion/visit_correction.h"

namespace forgescan {

Result<VisitErrorOptions> VisitOptionsOf(const FusionConfig& config) {
  if (!config.robot_shift_mm.has_value() || !config.robot_turn_rad.has_value()) {
    return Fail(ErrorCode::kInvalidArgument,
                "standing surfaces ask for robot_shift_mm and robot_turn_rad in [fusion]: what the robot "
                "scatters");
  }
  VisitErrorOptions options;
  options.robot_shift_mm = *config.robot_shift_mm;
  options.robot_turn_rad = *config.robot_turn_rad;
  options.max_sigmas = config.max_robot_sigmas;
  options.min_cells = static_cast<std::size_t>(config.min_standing_cells);
  return options;
}

VisitCorrection::VisitCorrection(StandingSurfaces standing, const VisitErrorOptions& options)
    : standing_(std::move(standing)), options_(AgainstMeanOf(standing_.scans, options)) {
  options_.cells.cell_rad = standing_.cell_rad;
}

Result<CorrectedVisit> VisitCorrection::Of(int view, const PointCloud& cloud_in_camera) const {
  const auto index = static_cast<std::size_t>(view);  // a negative one is far beyond the last
  const std::span<const SurfaceCell> cells = index < standing_.views.size()
                                                 ? std::span<const SurfaceCell>(standing_.views[index])
                                                 : std::span<const SurfaceCell>();
  ASSIGN_OR_RETURN(const VisitError error, EstimateVisitError(cells, cloud_in_camera, options_));
  CorrectedVisit visit;
  visit.cells = error.cells;
  if (error.cells < options_.min_cells) {
    visit.text = fmt::format("only {} cells of what stands still seen, at least {}: not corrected",
                             error.cells, options_.min_cells);
    return visit;
  }
  visit.corrected = true;
  visit.taught_from_actual = error.taught_from_actual;
  visit.shift_um = 1e3 * error.shift_mm;
  visit.turn_urad = 1e6 * Eigen::AngleAxisd(error.taught_from_actual.linear()).angle();
  visit.text = fmt::format("corrected by {:.1f} um and {:.0f} urad, {} cells", visit.shift_um,
                           visit.turn_urad, visit.cells);
  return visit;
}

}  // namespace forgescan
