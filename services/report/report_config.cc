#include "services/report/report_config.h"

namespace forgescan {

namespace {

void ReadDimensions(ConfigTable table, DimensionOptions& options) {
  int min_points = static_cast<int>(options.min_points);
  table.Optional("min_points", min_points, 10, 1'000'000);
  options.min_points = static_cast<std::size_t>(min_points);
  table.Optional("min_arc_deg", options.min_arc_deg, 10.0, 360.0);
  table.Optional("flag_removed_share", options.flag_removed_share, 0.0, 1.0);
  table.Optional("max_form_share", options.fit.max_form_share, 0.001, 0.5);
  table.Optional("max_form_sigma_mm", options.fit.max_form_sigma_mm, 0.001, 10.0);
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
  ConfigTable budget = table.Table("uncertainty");
  budget.Optional("view_matrix_mm", config.uncertainty.view_matrix_mm, 0.0, 10.0);
  budget.Optional("scanner_mm", config.uncertainty.scanner_mm, 0.0, 10.0);
  budget.Optional("refraction_mm", config.uncertainty.refraction_mm, 0.0, 10.0);
  budget.Optional("temperature_k", config.uncertainty.temperature_k, 0.0, 200.0);
  budget.Optional("expansion_slope_per_k", config.uncertainty.expansion_slope_per_k, 0.0, 1e-3);
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
