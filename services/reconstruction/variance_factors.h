// How the noise of the frames becomes that of a coordinate, where all frames show what they should.
#pragma once

#include "services/reconstruction/pattern_set.h"
#include "services/reconstruction/phase_estimator.h"

namespace forgescan {

// A coordinate's variance is ((read noise^2 + gain A) all_px2 + gain B lit_px2) / B^2, with B of the
// pattern's first frequency.
struct VarianceFactors {
  double all_px2 = 0;
  double lit_px2 = 0;
};

// At the column that is so many turns of frequency `base` from the pattern's origin. Source: to first order a
// change of frame i moves the coordinate by sum_j w_j L_j / (2 pi B_j) (cos phi_j sine(j,i) - sin phi_j
// cosine(j,i)); its grey value is A + B_j cos(phi_j + shift).
VarianceFactors FindVarianceFactors(const PatternSet& pattern, const PhaseEstimator& estimator, int base,
                                    double turns);

}  // namespace forgescan
