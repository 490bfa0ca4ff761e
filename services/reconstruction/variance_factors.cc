#include "services/reconstruction/variance_factors.h"

#include <cmath>
#include <numbers>

namespace forgescan {
namespace {

constexpr double kTwoPi = 2 * std::numbers::pi;

double RatioToFirst(const PatternSet& pattern, std::size_t frequency) {
  return pattern.frequencies[frequency].modulation_ratio / pattern.frequencies[0].modulation_ratio;
}

}  // namespace

VarianceFactors FindVarianceFactors(const PatternSet& pattern, const PhaseEstimator& estimator, int base,
                                    double turns) {
  const auto& frequencies = pattern.frequencies;
  const double column_px = turns * frequencies[static_cast<std::size_t>(base)].period_px;
  const auto phase = [&](std::size_t j) { return kTwoPi * column_px / frequencies[j].period_px; };
  VarianceFactors factors;
  for (std::size_t own = 0; own < frequencies.size(); ++own) {
    for (std::size_t n = 0; n < frequencies[own].frame_index.size(); ++n) {
      const auto i = static_cast<Eigen::Index>(frequencies[own].frame_index[n]);
      double moved_px = 0;
      for (std::size_t j = 0; j < frequencies.size(); ++j) {
        const auto row = static_cast<Eigen::Index>(j);
        const double turned =
            std::cos(phase(j)) * estimator.sine(row, i) - std::sin(phase(j)) * estimator.cosine(row, i);
        moved_px +=
            estimator.fusion[j] * frequencies[j].period_px / kTwoPi / RatioToFirst(pattern, j) * turned;
      }
      const double wave = RatioToFirst(pattern, own) * std::cos(phase(own) + frequencies[own].shift_rad[n]);
      factors.all_px2 += moved_px * moved_px;
      factors.lit_px2 += moved_px * moved_px * wave;
    }
  }
  return factors;
}

}  // namespace forgescan
