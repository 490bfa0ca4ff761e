#include "services/report/report_config.h"

namespace forgescan {

namespace {

void ReadDimensions(ConfigTable table, DimensionOptions& options) {
  int min_points = static_cast<int>(options.min_points);
  table.Optional("min_points", min_points, 10, 1'000'000);
  options.min_points = static_cast<std::size_t>(min_points);
  table.Optional("min_arc_deg", options.min_arc_deg, 10.0, 360.0);
  bool hold_axis = options.short_arc == ShortArc::kHoldAxis;
  table.Optional("hold_axis_of_short_arcs", hold_axis);
  options.short_arc = hold_axis ? ShortArc::kHoldAxis : ShortArc::kRefuse;
  table.Optional("form_cell_mm", options.influence.form_cell_mm, 0.1, 1000.0);
  table.Optional("patch_cell_mm", options.influence.patch_cell_mm, 0.1, 1000.0);
  table.Optional("flag_removed_share", options.flag_removed_share, 0.0, 1.0);
  table.Optional("max_form_share", options.fit.max_form_share, 0.001, 0.5);
  table.Optional("max_form_sigma_mm", options.fit.max_form_sigma_mm, 0.001, 10.0);
}

void ReadBudget(ConfigTable table, UncertaintyBudget& budget) {
  table.Optional("view_shift_mm", budget.view_shift_mm, 0.0, 10.0);
  table.Optional("view_turn_rad", budget.view_turn_rad, 0.0, 0.1);
  table.Optional("robot_shift_mm", budget.robot_shift_mm, 0.0, 10.0);
  table.Optional("robot_turn_rad", budget.robot_turn_rad, 0.0, 0.1);
  table.Optional("refraction_mm", budget.refraction_mm, 0.0, 10.0);
  table.Optional("patch_mm", budget.patch_mm, 0.0, 10.0);
  table.Optional("surface_mm", budget.surface_mm, 0.0, 10.0);
  table.Optional("scanner_scale", budget.scanner_scale, 0.0, 0.1);
  table.Optional("temperature_k", budget.temperature_k, 0.0, 200.0);
  table.Optional("view_temperature_k", budget.view_temperature_k, 0.0, 200.0);
  table.Optional("expansion_slope_per_k", budget.expansion_slope_per_k, 0.0, 1e-3);
}

}  // namespace

Result<ReportConfig> ReportConfig::Load(ConfigTable table) {
  ReportConfig config;
  table.Optional("part_timeout_s", config.part_timeout_s, 1.0, 3600.0);
  table.Optional("loss_settle_s", config.loss_settle_s, 0.1, 60.0);
  table.Optional("page_delay_s", config.page_delay_s, 0.0, 60.0);
  table.Optional("trend_parts", config.trend_parts, 3, 1000);
  table.Optional("index_parts", config.index_parts, 1, 10'000);
  table.Optional("deviation_scale_mm", config.deviation_scale_mm, 0.001, 1000.0);
  table.Optional("picture_width_px", config.picture_width_px, 400, 8000);
  ReadBudget(table.Table("uncertainty"), config.uncertainty);
  ReadDimensions(table.Table("dimensions"), config.dimensions);
  RETURN_IF_ERROR(table.Finish());
  RETURN_IF_ERROR(config.Check());
  return config;
}

Status ReportConfig::Check() const {
  if (loss_settle_s >= part_timeout_s) {
    return Fail(ErrorCode::kInvalidArgument,
                "report: loss_settle_s is {} s, it must be below part_timeout_s, {} s", loss_settle_s,
                part_timeout_s);
  }
  return uncertainty.Check();
}

}  // namespace forgescan
