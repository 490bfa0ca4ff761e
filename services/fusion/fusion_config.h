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

  static Result<FusionConfig> Load(ConfigTable table);
};

}  // namespace forgescan
