// Configuration of the fusion service: table [fusion] of station.toml.
#pragma once

#include <optional>
#include <vector>

#include "services/common/config/config.h"

namespace forgescan {

struct FusionConfig {
  double reference_temperature_degc = 900.0;  // sizes are given for it
  std::vector<double> expansion_degc;         // dilatometer table of the part's steel
  std::vector<double> expansion;              // relative elongation at each of expansion_degc
  std::vector<double> fixed_point_mm = {0, 0,
                                        0};  // in the array frame: where the part is held while it shrinks
  int missing_views_allowed = 0;             // more void views than this and the part is not inspected
  double view_timeout_s = 60.0;              // from the end of the scan to the last view's cloud
  // Against the robot's body when the view matrices were taught. Beyond, a view is counted and named, and
  // void if the station's metrologist says so: how much the path moves with the body is a property of the
  // robot.
  double max_body_change_k = 5.0;
  bool body_change_voids = false;
  // What the robot scatters, standard deviations on each axis about the middle of a view. Required with
  // standing surfaces, and used for nothing else.
  std::optional<double> robot_shift_mm, robot_turn_rad;
  int min_standing_cells = 100;  // fewer that a view has seen again, and it keeps the robot's error
  double max_robot_sigmas = 6;   // an error beyond so many standard deviations is a knock: the view is void

  static Result<FusionConfig> Load(ConfigTable table);
};

}  // namespace forgescan
