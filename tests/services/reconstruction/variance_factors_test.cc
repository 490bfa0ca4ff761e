#include "services/reconstruction/variance_factors.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "services/reconstruction/decoded_view.h"
#include "tests/services/reconstruction/phase_scene.h"

namespace forgescan {
namespace {

// Its mean over all phases is what weights of inverse variances promise: (L / 2 pi)^2 / (1 + (63 / 64)^2
// / 1.5 + (56 / 64)^2 / 1.5), and the light of the fringes adds nothing in the mean.
TEST(VarianceFactors, HaveTheMeanOfTheFormula) {
  const PatternSet pattern = StationPattern(Background::kShared);
  const auto estimator = MakePhaseEstimator(pattern);
  ASSERT_TRUE(estimator.ok());
  constexpr int kSteps = 64 * 64;
  VarianceFactors mean;
  for (int i = 0; i < kSteps; ++i) {
    const VarianceFactors factors = FindVarianceFactors(pattern, *estimator, 1, i / 64.0);
    ASSERT_GT(factors.all_px2, std::abs(factors.lit_px2));
    mean.all_px2 += factors.all_px2 / kSteps;
    mean.lit_px2 += factors.lit_px2 / kSteps;
  }
  const double rad_px = pattern.frequencies[1].period_px / (2 * std::numbers::pi);
  EXPECT_NEAR(mean.all_px2 / (rad_px * rad_px),
              1 / (1 + std::pow(63.0 / 64, 2) / 1.5 + std::pow(56.0 / 64, 2) / 1.5), 1e-6);
  EXPECT_NEAR(mean.lit_px2 / mean.all_px2, 0, 0.01);
}

TEST(UpperOfFloat, KeepsAFloatTo04Percent) {
  for (const float value : {0.0F, 1e-12F, 0.0049F, 0.3F, 1.0F, 77.7F, 1e20F}) {
    EXPECT_NEAR(FloatFromUpper(UpperOfFloat(value)), value, 0.004F * value);
  }
}

}  // namespace
}  // namespace forgescan
