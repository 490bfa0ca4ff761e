// Configuration of the fusion service: table [fusion] of station.toml.
#pragma once

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

  static Result<FusionConfig> Load(ConfigTable table);
};

}  // namespace forgescan
