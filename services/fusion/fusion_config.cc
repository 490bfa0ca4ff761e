#include "services/fusion/fusion_config.h"

namespace forgescan {

Result<FusionConfig> FusionConfig::Load(ConfigTable table) {
  FusionConfig config;
  table.Required("reference_temperature_degc", config.reference_temperature_degc, 0.0, 1500.0);
  table.Required("expansion_degc", config.expansion_degc, 0, -50.0, 1500.0);
  table.Required("expansion", config.expansion, 0, -0.1, 0.1);
  if (table.Has("fixed_point_mm")) {
    table.Required("fixed_point_mm", config.fixed_point_mm, 3, -10'000.0, 10'000.0);
  }
  table.Optional("missing_views_allowed", config.missing_views_allowed, 0, 100);
  table.Optional("view_timeout_s", config.view_timeout_s, 1.0, 3600.0);
  table.Optional("max_body_change_k", config.max_body_change_k, 0.1, 200.0);
  table.Optional("body_change_voids", config.body_change_voids);
  if (table.Has("robot_shift_mm") || table.Has("robot_turn_rad")) {
    table.Required("robot_shift_mm", config.robot_shift_mm.emplace(), 0.0001, 1.0);
    table.Required("robot_turn_rad", config.robot_turn_rad.emplace(), 1e-7, 0.01);
  }
  table.Optional("min_standing_cells", config.min_standing_cells, 1, 100'000);
  table.Optional("max_robot_sigmas", config.max_robot_sigmas, 1.0, 100.0);
  RETURN_IF_ERROR(table.Finish());
  return config;
}

}  // namespace forgescan
