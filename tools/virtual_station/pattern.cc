#include "tools/virtual_station/pattern.h"

#include <cmath>
#include <numbers>

namespace forgescan {

std::vector<Pattern> ProjectedPatterns(const ProjectorLightConfig& light, ProjectedSet set) {
  const auto period = [&](std::size_t i) { return light.unambiguous_px / light.fringe_counts[i]; };
  std::vector<Pattern> patterns;
  const auto add = [&](std::size_t frequency, int steps) {
    for (int i = 0; i < steps; ++i) {
      patterns.push_back({period(frequency), 90.0 * i});
    }
  };
  if (set == ProjectedSet::kReduced) {
    add(1, 2);
    add(0, 3);
    add(2, 2);
  } else {
    add(0, 4);
    add(1, 4);
    add(2, 4);
  }
  patterns.push_back({});
  return patterns;
}

double PatternLevel(const ProjectorLightConfig& light, const Pattern& pattern, double u_px) {
  const double a = light.amplitude;
  double level = 0.0;
  if (pattern.period_px == 0.0) {
    const double t = (1.0 - light.mean_level) / a;
    level = 1.0 + 2.0 * a * light.second_harmonic_ratio * t * t;
  } else {
    // x + 2 r (x - mean)^2 / a is the slightly bent response; blur takes contrast c from the first harmonic,
    // c^4 from the second.
    const double phase =
        2.0 * std::numbers::pi * u_px / pattern.period_px + pattern.shift_deg * std::numbers::pi / 180.0;
    const double width = 2.0 * std::numbers::pi * light.blur_px / pattern.period_px;
    const double contrast = std::exp(-0.5 * width * width);
    level = light.mean_level +
            a * (contrast * std::cos(phase) +
                 light.second_harmonic_ratio * (1.0 + std::pow(contrast, 4) * std::cos(2.0 * phase)));
  }
  return light.black_level + (1.0 - light.black_level) * level;
}

}  // namespace forgescan
