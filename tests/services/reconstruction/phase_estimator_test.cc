#include "services/reconstruction/phase_estimator.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

namespace forgescan {
namespace {

constexpr double kPi = std::numbers::pi;

PatternSet Steps(Background background, std::vector<int> frames) {
  PatternSet pattern;
  pattern.projector_width_px = 1280;
  pattern.background = background;
  double period_px = 20;
  for (const int count : frames) {
    FringeFrequency frequency{.period_px = period_px, .frame_index = {}, .shift_rad = {}};
    for (int i = 0; i < count; ++i) {
      frequency.frame_index.push_back(pattern.frame_count());
      frequency.shift_rad.push_back(i * kPi / 2);
      pattern.frame_names.push_back(std::to_string(pattern.frame_count()));
    }
    pattern.frequencies.push_back(frequency);
    period_px += 0.37;
  }
  return pattern;
}

double Phase(const PhaseEstimator& estimator, int j, const Eigen::VectorXd& grey) {
  return std::atan2(estimator.sine.row(j).dot(grey), estimator.cosine.row(j).dot(grey));
}

TEST(PhaseEstimator, FourOwnFramesAreTheClassicArctan) {
  const auto estimator = MakePhaseEstimator(Steps(Background::kOwn, {4, 4}));
  ASSERT_TRUE(estimator.ok());
  Eigen::VectorXd grey(8);
  grey << 131, 60, 88, 170, 20, 220, 90, 33;  // any numbers: the estimate is linear
  EXPECT_NEAR(Phase(*estimator, 0, grey), std::atan2(170 - 60, 131 - 88), 1e-12);
  EXPECT_NEAR(Phase(*estimator, 1, grey), std::atan2(33 - 220, 20 - 90), 1e-12);
  EXPECT_EQ(estimator->redundancy, 2);
  EXPECT_NEAR(estimator->PhaseNoise(0), std::sqrt(0.5), 1e-12);          // variance sigma^2 / (2 B^2)
  EXPECT_NEAR(estimator->ReferenceNoise(0, 1), std::sqrt(0.75), 1e-12);  // A: 1/4, B: 1/2, independent
}

// Eq. (2)-(4) of the paper with delta_i = 2 pi (i - 1) / 4.
TEST(PhaseEstimator, SevenSharedFramesAreThePapersFormula) {
  const auto estimator = MakePhaseEstimator(Steps(Background::kShared, {3, 2, 2}));
  ASSERT_TRUE(estimator.ok());
  Eigen::VectorXd grey(7);
  grey << 131, 60, 88, 170, 20, 220, 90;
  const double twice_background = grey(0) + grey(2);
  EXPECT_NEAR(Phase(*estimator, 0, grey), std::atan2(twice_background - 2 * grey(1), grey(0) - grey(2)),
              1e-12);
  EXPECT_NEAR(Phase(*estimator, 1, grey),
              std::atan2(twice_background - 2 * grey(4), 2 * grey(3) - twice_background), 1e-12);
  EXPECT_NEAR(Phase(*estimator, 2, grey),
              std::atan2(twice_background - 2 * grey(6), 2 * grey(5) - twice_background), 1e-12);
  EXPECT_EQ(estimator->redundancy, 0);
  EXPECT_NEAR(std::pow(estimator->PhaseNoise(0), 2), 1.0, 1e-12);  // mean variances in sigma^2 / B^2
  EXPECT_NEAR(std::pow(estimator->PhaseNoise(1), 2), 1.5, 1e-12);
}

TEST(PhaseEstimator, RefusesShiftsThatDoNotDetermineThePhase) {
  PatternSet pattern = Steps(Background::kOwn, {4, 3});
  pattern.frequencies[1].shift_rad = {0, kPi, 2 * kPi};
  EXPECT_EQ(MakePhaseEstimator(pattern).error().code, ErrorCode::kDegenerate);
  EXPECT_TRUE(MakePhaseEstimator(Steps(Background::kOwn, {4, 3})).ok());
}

TEST(TurnsFromPhasor, IsWithinAMillionthRadianEverywhere) {
  constexpr int kSteps = 100000;
  for (int i = 0; i < kSteps; ++i) {
    const double angle = 2 * kPi * i / kSteps;
    const auto c = static_cast<float>(73 * std::cos(angle)), s = static_cast<float>(73 * std::sin(angle));
    const double exact = std::atan2(static_cast<double>(s), static_cast<double>(c));
    const double off = 2 * kPi * static_cast<double>(TurnsFromPhasor(c, s)) - exact;
    ASSERT_NEAR(off - 2 * kPi * std::round(off / (2 * kPi)), 0, 1e-6) << angle;  // rad; the documented bound
  }
  EXPECT_EQ(TurnsFromPhasor(0, 0), 0.0F);
}

}  // namespace
}  // namespace forgescan
