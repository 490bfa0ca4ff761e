// Student's t distribution, as far as confidence limits need it.
#pragma once

namespace forgescan {

// Probability that |t| stays below `t` >= 0 with `degrees_of_freedom` >= 1.
// Source: Abramowitz and Stegun, Handbook of Mathematical Functions, 26.7.3 and 26.7.4 (exact for whole
// degrees of freedom).
double StudentTwoSided(double t, int degrees_of_freedom);

// The t below which |t| stays with the probability `confidence`, in (0, 1); e.g. 2.306 for 0.95 and 8.
// NaN outside of these ranges.
double StudentQuantile(double confidence, int degrees_of_freedom);

}  // namespace forgescan
