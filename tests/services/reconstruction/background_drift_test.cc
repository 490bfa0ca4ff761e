// What a background that drifts from frame to frame costs with each order of the frames, and whether it is
// noticed.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <opencv2/core.hpp>

#include "services/reconstruction/fringe_decoder.h"
#include "services/reconstruction/trust.h"
#include "tests/services/reconstruction/phase_scene.h"

namespace forgescan {
namespace {

using ::testing::DoubleNear;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

constexpr double kTwoPi = 2 * std::numbers::pi;
constexpr double kModulationDn = 80;

// The three-frame block first, as the paper lists it.
PatternSet ThreeFirst() {
  PatternSet pattern = StationPattern(Background::kShared);
  std::swap(pattern.frequencies[0], pattern.frequencies[1]);
  int next = 0;
  for (FringeFrequency& frequency : pattern.frequencies) {
    for (int& frame : frequency.frame_index) {
      frame = next++;
    }
  }
  return pattern;
}

PatternSet WithMidGrey(PatternSet pattern) {
  pattern.reference_light = ReferenceLight::kMidGrey;
  return pattern;
}

Columns Sweep() {
  Columns columns(120, 300);
  cv::RNG random(7);
  random.fill(columns, cv::RNG::UNIFORM, 100.0, 1800.0);
  return columns;
}

// Rms error of the coordinate, px, in light without noise; 16 bit, so that rounding is nothing.
double RmsErrorPx(const PatternSet& pattern, double drift_dn) {
  ReconstructionConfig config;
  config.noise = {.read_noise_dn = 0.3, .gain_dn = 0};
  config.reference_tolerance_modulation = 0.99;  // none of the masks applies: a masked one would make it NaN
  config.max_pixel_disagreement_rad = 4;
  config.min_unwrap_margin_fraction = 0;
  const Columns columns = Sweep();
  const auto frames = RenderColumns(
      columns, pattern, {.modulation_dn = kModulationDn, .noise = {0, 0}, .drift_dn = drift_dn}, CV_16UC1);
  const auto view = FringeDecoder::Create(pattern, config)->Decode(frames);
  double squares = 0;
  for (int row = 0; row < columns.rows; ++row) {
    for (int column = 0; column < columns.cols; ++column) {
      squares += std::pow(static_cast<double>(view->coordinate_px(row, column)) - columns(row, column), 2);
    }
  }
  return std::sqrt(squares / static_cast<double>(columns.total()));
}

// The largest error of a phase is what a drift of one B a frame costs; the figures of a shared 3-2-2 set are
// known.
TEST(BackgroundDrift, CostsLeastWithTheThreeFramesInTheMiddleAndNothingWithAMidGreyFrame) {
  const auto gains = [](const PatternSet& pattern) { return MakePhaseEstimator(pattern)->drift_gain; };
  const auto near = [](double value) { return DoubleNear(value, 0.01); };
  EXPECT_THAT(gains(ThreeFirst()), ElementsAre(near(1), near(3.61), near(6.40)));
  EXPECT_THAT(gains(StationPattern(Background::kShared)), ElementsAre(near(3.61), near(1), near(3.61)));
  EXPECT_THAT(gains(StationPattern(Background::kOwn)),
              ElementsAre(near(std::sqrt(2.0)), near(std::sqrt(2.0)), near(std::sqrt(2.0))));
  EXPECT_THAT(gains(WithMidGrey(ThreeFirst())), ElementsAre(near(0), near(0), near(0)));
  EXPECT_THAT(gains(WithMidGrey(StationPattern(Background::kShared))),
              ElementsAre(near(0), near(0), near(0)));
}

// What the interpolation costs in noise, by the plain solution of eight equations.
TEST(BackgroundDrift, AMidGreyFramePaysWithNoise) {
  const auto noise = [](const PatternSet& pattern) {
    const auto estimator = MakePhaseEstimator(pattern);
    return std::vector{estimator->PhaseNoise(0), estimator->PhaseNoise(1), estimator->PhaseNoise(2)};
  };
  const auto near = [](double value) { return DoubleNear(value, 0.01); };
  EXPECT_THAT(noise(WithMidGrey(StationPattern(Background::kShared))),
              ElementsAre(near(1.65), near(1.02), near(1.22)));
  EXPECT_THAT(noise(WithMidGrey(ThreeFirst())), ElementsAre(near(1.01), near(1.16), near(1.27)));
}

// Coordinates of 31 px fringes, px rms; B = 80 DN. The noise of such a coordinate is 0.07 px at sigma = 1.6
// DN.
TEST(BackgroundDrift, CostsOfACoordinateBySimulation) {
  struct Case {
    const char* name;
    PatternSet pattern;
    double px_at_half_dn;
    double px_at_one_dn;
  };
  const Case cases[] = {{"3-2-2, white", ThreeFirst(), 0.0463, 0.0926},
                        {"2-3-2, white", StationPattern(Background::kShared), 0.0327, 0.0654},
                        {"4-4-4, white", StationPattern(Background::kOwn), 0.0176, 0.0352},
                        {"2-3-2, mid-grey", WithMidGrey(StationPattern(Background::kShared)), 0, 0}};
  for (const Case& one : cases) {
    SCOPED_TRACE(one.name);
    const double none_px = RmsErrorPx(one.pattern, 0), half_px = RmsErrorPx(one.pattern, 0.5),
                 one_px = RmsErrorPx(one.pattern, 1);
    std::printf("%-16s drift 0, 0.5, 1 DN a frame: %.4f %.4f %.4f px\n", one.name, none_px, half_px, one_px);
    EXPECT_LT(none_px, 0.0005);  // rounding to 16 bit and single precision
    EXPECT_NEAR(half_px, one.px_at_half_dn, 0.05 * one.px_at_half_dn + 0.001);
    EXPECT_NEAR(one_px, one.px_at_one_dn, 0.05 * one.px_at_one_dn + 0.001);
  }
}

struct Trial {
  TrustFigures figures;
  Status verdict;
};

struct Cut {
  int dn = 0;             // what the reference frame shows
  double of_columns = 0;  // in this part of its columns
};

Trial Try(const PatternSet& pattern, double drift_dn, double modulation_dn, const Cut& cut = {}) {
  ReconstructionConfig config;
  config.noise = {.read_noise_dn = 0.6, .gain_dn = 0.005};
  auto frames = RenderColumns(Sweep(), pattern,
                              {.modulation_dn = modulation_dn, .noise = config.noise, .drift_dn = drift_dn});
  const int columns = static_cast<int>(cut.of_columns * frames.back().cols);
  frames.back().colRange(0, columns).setTo(cut.dn);
  const auto decoder = FringeDecoder::Create(pattern, config);
  const auto view = decoder->Decode(frames);
  const auto figures = MeasureTrust(frames, *view, *decoder, config);
  EXPECT_TRUE(figures.ok());
  return {*figures, JudgeTrust(*figures, *decoder, config, "left")};
}

TEST(BackgroundDrift, IsMeasuredInEveryViewAndRefusedWhereTheBackgroundIsShared) {
  for (const double drift_dn : {-0.4, 0.0, 0.4}) {
    for (const PatternSet& pattern :
         {StationPattern(Background::kShared), StationPattern(Background::kOwn),
          WithMidGrey(StationPattern(Background::kShared)), WithMidGrey(StationPattern(Background::kOwn))}) {
      const Trial trial = Try(pattern, drift_dn, kModulationDn);
      EXPECT_NEAR(trial.figures.drift_dn.value(), drift_dn,
                  0.05);  // DN; B is off by the drift as well, to second order
      EXPECT_TRUE(trial.verdict.ok()) << trial.verdict.error().message;
    }
  }
  const Trial refused = Try(StationPattern(Background::kShared), 1, 50);
  ASSERT_FALSE(refused.verdict.ok());
  EXPECT_EQ(refused.verdict.error().code, ErrorCode::kUntrusted);
  EXPECT_THAT(refused.verdict.error().message, HasSubstr("the background of the left camera drifts by"));
  EXPECT_NEAR(refused.figures.drift_phase_rad.value(), 3.61 / 50, 0.003);
  for (const PatternSet& pattern :
       {WithMidGrey(StationPattern(Background::kShared)), StationPattern(Background::kOwn)}) {
    const Status verdict = Try(pattern, 1, 50).verdict;
    EXPECT_TRUE(verdict.ok()) << verdict.error().message;
  }
}

// A drift that is large enough to be refused must not pass because nothing shows it. The fringes end at 160
// DN, so a cut between that and full scale shows in the reference frame alone.
TEST(BackgroundDrift, IsNotJudgedByAReferenceThatIsCutOff) {
  const PatternSet shared = StationPattern(Background::kShared);
  for (const Cut& cut : {Cut{255, 1}, Cut{0, 1}, Cut{255, 0.6}, Cut{0, 0.6}, Cut{150, 1}, Cut{168, 1},
                         Cut{200, 0.6}, Cut{245, 1}, Cut{246, 0.6}}) {
    SCOPED_TRACE(cut.dn);
    for (const double drift_dn : {0.0, 0.4, 1.0}) {
      const Trial trial = Try(shared, drift_dn, 50, cut);
      ASSERT_FALSE(trial.verdict.ok());
      EXPECT_EQ(trial.verdict.error().code, ErrorCode::kUntrusted);
      EXPECT_THAT(trial.verdict.error().message,
                  HasSubstr("the reference frame of the left camera is cut off"));
      EXPECT_NEAR(trial.figures.uncut_reference_fraction.value(), 1 - cut.of_columns, 0.02);  // of samples
    }
    EXPECT_TRUE(Try(StationPattern(Background::kOwn), 0, 50, cut).verdict.ok());
  }
  const Trial part = Try(shared, 0, 50, {255, 0.4});
  EXPECT_TRUE(part.verdict.ok()) << part.verdict.error().message;
  EXPECT_NEAR(part.figures.drift_dn.value(), 0, 0.05);  // DN: what is left shows it
}

}  // namespace
}  // namespace forgescan
