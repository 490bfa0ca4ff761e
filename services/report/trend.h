// How a dimension moves from part to part: wear of the die, seen before it makes scrap.
#pragma once

#include <optional>
#include <span>

#include "services/common/result.h"

namespace forgescan {

struct TrendPoint {
  double part_index;  // place in the order of production; gaps = parts without this measurement
  double value_mm;
};

// Least-squares line y = a + b x over the parts.
struct Trend {
  int count = 0;
  double intercept_mm = 0.0;
  double slope_mm = 0.0;           // per part
  double residual_sigma_mm = 0.0;  // s, n - 2 degrees of freedom
  double individual_sigma_mm =
      0.0;  // from the moving range, mean |y(i+1) - y(i)| / 1.128: part to part, without the trend
  double mean_index = 0.0;
  double sxx = 0.0;          // sum of (x - mean)^2
  double t_limit = 0.0;      // two-sided 95 %, n - 2
  bool significant = false;  // n >= 8 and |b| sqrt(Sxx) > t s

  double At(double part_index) const { return intercept_mm + slope_mm * part_index; }
  // Half width of the 95 % interval in which the next single value lies.
  double PredictionHalfWidthMm(double part_index) const;
};

inline constexpr int kTrendMinParts = 8;

// Source: ordinary regression; I-MR chart for the individual sigma.
// Errors: kDegenerate (fewer than 3 points, or all at one index), kInvalidArgument (a number that is not
// finite).
Result<Trend> FitTrend(std::span<const TrendPoint> points);

struct SizeLimits {
  double lower_mm;
  double upper_mm;
  double uncertainty_mm;  // expanded: the limits are shrunk by it, as in the verdict
};

// How many parts after `last_index` still stay (95 %) within the limit the trend moves towards; 0 = the next
// may pass it. Nothing if the trend is not significant, or not within kTrendHorizonParts.
inline constexpr int kTrendHorizonParts = 10'000;
std::optional<int> PartsToLimit(const Trend& trend, const SizeLimits& limits, double last_index);

}  // namespace forgescan
