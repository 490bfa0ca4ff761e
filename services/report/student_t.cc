#include "services/report/student_t.h"

#include <cmath>
#include <limits>
#include <numbers>

namespace forgescan {

double StudentTwoSided(double t, int degrees_of_freedom) {
  const double angle = std::atan(t / std::sqrt(static_cast<double>(degrees_of_freedom)));
  const double cos2 = std::cos(angle) * std::cos(angle);
  const bool odd = degrees_of_freedom % 2 != 0;
  double term = odd ? std::cos(angle) : 1.0;
  double sum = degrees_of_freedom > 1 ? term : 0.0;
  for (int k = odd ? 3 : 2; k <= degrees_of_freedom - 2; k += 2) {
    term *= cos2 * (k - 1) / k;
    sum += term;
  }
  return odd ? 2.0 / std::numbers::pi * (angle + std::sin(angle) * sum) : std::sin(angle) * sum;
}

double StudentQuantile(double confidence, int degrees_of_freedom) {
  if (degrees_of_freedom < 1 || !(confidence > 0.0 && confidence < 1.0)) {
    return std::numeric_limits<double>::quiet_NaN();
  }
  double low = 0.0;
  double high = 1.0;
  while (StudentTwoSided(high, degrees_of_freedom) < confidence && high < 1e12) {
    high *= 2.0;
  }
  for (int i = 0; i < 200 && high - low > 1e-12 * high; ++i) {
    const double middle = 0.5 * (low + high);
    (StudentTwoSided(middle, degrees_of_freedom) < confidence ? low : high) = middle;
  }
  return 0.5 * (low + high);
}

}  // namespace forgescan
