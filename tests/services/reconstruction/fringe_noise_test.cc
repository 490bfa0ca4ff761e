// The noise of a phase and of a coordinate: what is predicted, and what noisy frames show.
#include <array>
#include <cmath>
#include <numbers>

#include "services/reconstruction/phase_estimator.h"
#include "tests/services/reconstruction/decoded_phases.h"

namespace forgescan {
namespace {

constexpr double kTwoPi = 2 * std::numbers::pi;

struct Bin {
  double measured = 0;
  double predicted = 0;
  long count = 0;
};

// DOMAIN's figures, which the general formula must give: 1 + cos(2 phi) / 2, 1.5 + sin(2 phi) / 2, own frames
// 1/2.
TEST(PhaseVariance, IsThePublishedFormula) {
  const auto shared = MakePhaseEstimator(StationPattern(Background::kShared));
  const auto own = MakePhaseEstimator(StationPattern(Background::kOwn));
  for (double phase = 0; phase < kTwoPi; phase += 0.1) {
    EXPECT_NEAR(shared->PhaseVariance(1, phase), 1 + 0.5 * std::cos(2 * phase), 1e-9);
    EXPECT_NEAR(shared->PhaseVariance(0, phase), 1.5 + 0.5 * std::sin(2 * phase), 1e-9);
    EXPECT_NEAR(own->PhaseVariance(0, phase), 0.5, 1e-9);
  }
}

TEST(PhaseVariance, IsWhatNoisyFramesShowInEachOf16Phases) {
  constexpr double kNoiseDn = 2, kModulationDn = 80, kRounding = 1.0 / 12;
  const Columns columns = Sweep({1000, 500});
  for (const Background background : {Background::kShared, Background::kOwn}) {
    const PatternSet pattern = StationPattern(background);
    const auto estimator = MakePhaseEstimator(pattern);
    const auto frames =
        RenderColumns(columns, pattern, {.modulation_dn = kModulationDn, .noise = {kNoiseDn, 0}});
    for (std::size_t j = 0; j < 3; ++j) {
      const auto at = static_cast<Eigen::Index>(j);
      std::array<Bin, 16> bins;
      for (int row = 0; row < columns.rows; ++row) {
        for (int column = 0; column < columns.cols; ++column) {
          double c = 0, s = 0;
          for (std::size_t i = 0; i < frames.size(); ++i) {
            const double grey = frames[i].at<std::uint8_t>(row, column);
            c += estimator->cosine(at, static_cast<Eigen::Index>(i)) * grey;
            s += estimator->sine(at, static_cast<Eigen::Index>(i)) * grey;
          }
          const double turns = columns(row, column) / pattern.frequencies[j].period_px;
          const double phase = kTwoPi * (turns - std::floor(turns));
          const double off = std::remainder(std::atan2(s, c) - phase, kTwoPi);
          Bin& bin = bins[static_cast<std::size_t>(16 * (turns - std::floor(turns)))];
          bin.measured += off * off;
          bin.predicted += estimator->PhaseVariance(static_cast<int>(j), phase) *
                           (kNoiseDn * kNoiseDn + kRounding) / (kModulationDn * kModulationDn);
          ++bin.count;
        }
      }
      for (const Bin& bin : bins) {
        EXPECT_GT(bin.count, 25000);
        EXPECT_NEAR(bin.measured / bin.predicted, 1,
                    0.05);  // 30,000 values: the variance of their variance is 0.8 %
      }
    }
  }
}

// Camera noise that grows with the light, as a coordinate sees it, in 16 phases of each frequency.
TEST(FringeDecoder, PredictsTheNoiseOfACoordinateInEveryPhase) {
  ReconstructionConfig config;
  config.noise = {.read_noise_dn = 1, .gain_dn = 0.03};
  const Columns columns = Sweep({1400, 2000});
  for (const Background background : {Background::kShared, Background::kOwn}) {
    const PatternSet pattern = StationPattern(background);
    const auto frames = RenderColumns(columns, pattern, {.noise = config.noise});
    config.noise.read_noise_dn = std::sqrt(1 + 1.0 / 12);  // whole grey values
    const DecodedView view = Decode(Decoder(pattern, config), frames);
    config.noise.read_noise_dn = 1;
    for (std::size_t j = 0; j < 3; ++j) {
      std::array<Bin, 16> bins;
      for (int row = 0; row < columns.rows; row += 2) {  // variances are those of even rows
        for (int column = 0; column < columns.cols; ++column) {
          const double turns = columns(row, column) / pattern.frequencies[j].period_px;
          const double off = static_cast<double>(view.coordinate_px(row, column)) - columns(row, column);
          Bin& bin = bins[static_cast<std::size_t>(16 * (turns - std::floor(turns)))];
          if (std::abs(off) < 1) {
            bin.measured += off * off;
            bin.predicted += std::pow(static_cast<double>(view.SigmaPx(row, column)), 2);
            ++bin.count;
          }
        }
      }
      for (const Bin& bin : bins) {
        EXPECT_NEAR(bin.measured / bin.predicted, 1, 0.05) << bin.count;
      }
    }
  }
}

TEST(FringeDecoder, WrongFringeOrdersAreRarerThanOneIn50000BeforeAnyRepair) {
  ReconstructionConfig config;
  config.noise = {.read_noise_dn = 0.03 * 80, .gain_dn = 0};
  config.min_unwrap_margin_fraction = 0;  // so that no pixel is masked as doubtful
  config.max_pixel_disagreement_rad = 4;
  config.mask_border_px = 0;
  const Columns columns = Sweep({1700, 1300});
  const PatternSet pattern = StationPattern(Background::kShared);
  const auto frames = RenderColumns(columns, pattern, {.modulation_dn = 80, .noise = config.noise});
  const double half_period_px = pattern.frequencies[1].period_px / 2;
  for (const std::optional<SimdPath> path : {std::optional(BestSimdPath()), std::optional<SimdPath>()}) {
    const DecodedView view = Decode(Decoder(pattern, config, path), frames);
    long wrong = 0;
    for (int row = 0; row < columns.rows; ++row) {
      for (int column = 0; column < columns.cols; ++column) {  // what is masked counts as wrong
        wrong += !(std::abs(static_cast<double>(view.coordinate_px(row, column)) - columns(row, column)) <=
                   half_period_px);
      }
    }
    EXPECT_LT(static_cast<double>(wrong), 2e-5 * static_cast<double>(columns.total()));
  }
}

}  // namespace
}  // namespace forgescan
