// The expanded uncertainty of a size, and what it is made of.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "services/common/features/influence.h"
#include "services/common/result.h"

namespace forgescan {

// Standard uncertainties (one standard deviation) of what a size rests on. "View": of its points as a whole,
// through their middle, along or about each axis, independent of the other views.
struct UncertaintyBudget {
  double view_shift_mm = 0.008;  // of a view, by its view matrix
  double view_turn_rad = 0.00012;
  double robot_shift_mm = 0.005;  // of a view, by the robot's repeatability
  double robot_turn_rad = 0.000024;
  double refraction_mm = 0.02;  // of a view, by hot air; an assumption until it is measured
  double patch_mm = 0.01;       // of a patch of a view: what does not average out between neighbouring points
  double surface_mm = 0.015;    // height of every point over the surface, all views alike: calibration, glow
  double scanner_scale = 0.0002;    // relative, of every view about its middle
  double temperature_k = 2.4;       // of the part, common to all views: pyrometer, cooling within the part
  double view_temperature_k = 0.5;  // of the part at one view
  double expansion_slope_per_k = 2e-5;  // of the part's steel at forging heat, d(eps)/dT

  Status Check() const;
};

struct UncertaintyTerm {
  std::string name;
  double standard_mm = 0;
};

// Purpose: the contributions to the standard uncertainty of a size, independent of each other. Source: GUM
// (JCGM 100), law of propagation; the size's derivatives are those of the fits. A size chosen as the largest
// or smallest of many readings is off outwards by anything from nothing, where form decides, to the expected
// extreme of the readings' errors, where the face is perfect: evenly distributed in between (GUM 4.3.7) and
// not corrected, its root mean square is that extreme over the root of 3. Errors a whole view shares are not
// chosen from: they move many readings at once. A size without influence (a source that knows nothing of
// views) is taken as one between two opposite views. fit_mm: from the scatter of the points as if
// independent, used without an influence. Units: mm.
std::vector<UncertaintyTerm> UncertaintyTerms(const UncertaintyBudget& budget, const Influence& influence,
                                              double size_mm, double fit_mm);

// U = k times the root of the sum of squares, k = 2 (about 95 %). NaN in, NaN out: a fit that does not know
// its uncertainty gives no verdict.
double ExpandedUncertaintyMm(std::span<const UncertaintyTerm> terms);

}  // namespace forgescan
