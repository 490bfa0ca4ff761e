// The expanded uncertainty of a size: what the fit says of itself, and what it cannot know.
#pragma once

#include "services/common/result.h"

namespace forgescan {

// Standard uncertainties (one standard deviation) of a size, beside that of the fit itself.
struct UncertaintyBudget {
  double view_matrix_mm = 0.028;  // two views against each other: error of the view matrices and of the robot
  double scanner_mm = 0.02;       // scale of the scanner over one view
  double refraction_mm = 0.03;    // hot air between scanner and part; an assumption until it is measured
  double temperature_k = 2.4;     // of the part at a view against the temperature it was scaled with
  double expansion_slope_per_k = 2e-5;  // of the part's steel at forging heat, d(eps)/dT

  Status Check() const;
};

// U = 2 sqrt(u_fit^2 + u_view^2 + u_scanner^2 + u_refraction^2 + (size * slope * u_temperature)^2).
// Source: GUM, independent contributions, k = 2 (about 95 %).
// Units: mm. NaN in, NaN out: a fit that does not know its uncertainty gives no verdict.
double ExpandedUncertaintyMm(const UncertaintyBudget& budget, double size_mm, double fit_mm);

}  // namespace forgescan
