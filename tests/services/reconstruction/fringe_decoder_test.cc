#include "services/reconstruction/fringe_decoder.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <numbers>
#include <opencv2/core.hpp>
#include <optional>

#include "tests/services/reconstruction/phase_scene.h"

namespace forgescan {
namespace {

constexpr double kTwoPi = 2 * std::numbers::pi;
constexpr auto kValid = static_cast<std::uint8_t>(MaskCause::kValid);

FringeDecoder Decoder(const PatternSet& pattern, const ReconstructionConfig& config,
                      std::optional<SimdPath> path = BestSimdPath()) {
  auto decoder = FringeDecoder::Create(pattern, config, path);
  EXPECT_TRUE(decoder.ok());
  return std::move(decoder).value();
}

DecodedView Decode(const FringeDecoder& decoder, const std::vector<cv::Mat>& frames) {
  auto view = decoder.Decode(frames);
  EXPECT_TRUE(view.ok());
  return std::move(view).value();
}

bool AreSameBytes(const cv::Mat& a, const cv::Mat& b) {
  if (a.size() != b.size() || a.type() != b.type()) {
    return false;
  }
  for (int row = 0; row < a.rows; ++row) {
    if (std::memcmp(a.ptr(row), b.ptr(row), static_cast<std::size_t>(a.cols) * a.elemSize()) != 0) {
      return false;
    }
  }
  return true;
}

void ExpectSame(const DecodedView& a, const DecodedView& b) {
  EXPECT_TRUE(AreSameBytes(a.coordinate_px, b.coordinate_px));
  EXPECT_TRUE(AreSameBytes(a.variance_px2, b.variance_px2));
  EXPECT_TRUE(AreSameBytes(a.cause, b.cause));
  EXPECT_EQ(a.count, b.count);
  EXPECT_EQ(a.repaired, b.repaired);
  EXPECT_EQ(a.median_modulation_dn, b.median_modulation_dn);
  EXPECT_EQ(a.median_sigma_px, b.median_sigma_px);
}

TEST(FringeDecoder, StartsOnTheStationsScene) {
  const PatternSet pattern = StationPattern(Background::kShared);
  const ReconstructionConfig config;
  const StationScene scene = RenderStation({640, 480}, pattern, config.noise);
  const DecodedView view = Decode(Decoder(pattern, config), scene.frames);
  long lit = 0, kept = 0;
  for (int row = 0; row < view.cause.rows; ++row) {
    for (int column = 0; column < view.cause.cols; ++column) {
      const bool is_lit = !std::isnan(scene.columns(row, column)),
                 is_kept = view.cause(row, column) == kValid;
      lit += is_lit;
      kept += is_kept;
      ASSERT_FALSE(is_kept && !is_lit) << row << " " << column;
      if (is_kept) {  // 7 sigma: one in 10^11 pixels beyond
        ASSERT_NEAR(view.coordinate_px(row, column), scene.columns(row, column),
                    7 * view.SigmaPx(row, column));
      }
    }
  }
  EXPECT_GT(static_cast<double>(kept), 0.93 * static_cast<double>(lit));  // rims of 2 px, and the step's
  EXPECT_EQ(view.count[0], kept);
}

// The packed arithmetic rounds to 16 bit: 1.5e-4 rad of a phase are 0.0008 px of a fringe of 31 px.
TEST(FringeDecoder, PackedArithmeticIsThePlainOneButForRounding) {
  const PatternSet pattern = StationPattern(Background::kShared);
  const ReconstructionConfig config;
  const StationScene scene = RenderStation({613, 400}, pattern, config.noise);
  const FringeDecoder packed = Decoder(pattern, config), plain = Decoder(pattern, config, std::nullopt);
  ASSERT_TRUE(packed.is_packed());
  ASSERT_FALSE(plain.is_packed());
  const DecodedView a = Decode(packed, scene.frames), b = Decode(plain, scene.frames);
  long other_cause = 0;
  double squares = 0;
  for (int row = 0; row < a.cause.rows; ++row) {
    for (int column = 0; column < a.cause.cols; ++column) {
      other_cause += a.cause(row, column) != b.cause(row, column);
      if (a.cause(row, column) == kValid && b.cause(row, column) == kValid) {
        const double off_px =
            static_cast<double>(a.coordinate_px(row, column) - b.coordinate_px(row, column));
        ASSERT_LT(std::abs(off_px), 0.002);
        squares += off_px * off_px;
        // The packed one takes the mean of the three modulations, which differ by noise.
        ASSERT_NEAR(a.SigmaPx(row, column) / b.SigmaPx(row, column), 1, 0.15);
      }
    }
  }
  EXPECT_LT(std::sqrt(squares / static_cast<double>(a.count[0])), 0.0005);  // px; the noise is 0.08
  EXPECT_LT(other_cause, a.cause.rows * a.cause.cols / 1000);               // at the very limits
  EXPECT_NEAR(a.median_sigma_px, b.median_sigma_px, 0.01 * b.median_sigma_px);
}

TEST(FringeDecoder, EveryPathAndNumberOfThreadsGivesEqualBytes) {
  const PatternSet pattern = StationPattern(Background::kShared);
  for (const cv::Size size : {cv::Size(613, 301), cv::Size(45, 30), cv::Size(31, 17), cv::Size(2448, 40)}) {
    ReconstructionConfig config;
    config.threads = 1;
    const StationScene scene = RenderStation(size, pattern, config.noise);
    const DecodedView first = Decode(Decoder(pattern, config, SimdPath::kPlain), scene.frames);
    for (const SimdPath path : AvailableSimdPaths()) {
      for (const int threads : {1, 2, 5}) {
        SCOPED_TRACE(NameOf(path));
        config.threads = threads;
        ExpectSame(Decode(Decoder(pattern, config, path), scene.frames), first);
      }
    }
  }
}

TEST(FringeDecoder, ARecycledViewIsAsGoodAsAFreshOne) {
  const PatternSet pattern = StationPattern(Background::kShared);
  const ReconstructionConfig config;
  const FringeDecoder decoder = Decoder(pattern, config);
  const StationScene one = RenderStation({320, 200}, pattern, config.noise);
  const StationScene other = RenderStation({200, 100}, pattern, config.noise);
  const DecodedView fresh = Decode(decoder, one.frames);
  decoder.Recycle(Decode(decoder, other.frames));
  DecodedView view = Decode(decoder, one.frames);  // of another size
  ExpectSame(view, fresh);
  const float* const map = view.coordinate_px[0];
  decoder.Recycle(std::move(view));
  EXPECT_FALSE(decoder.Decode(std::span(one.frames).first(3)).ok());
  view = Decode(decoder, one.frames);  // works after the error
  EXPECT_EQ(view.coordinate_px[0], map);
  ExpectSame(view, fresh);
  const cv::Mat held = view.cause;
  decoder.Recycle(std::move(view));  // dropped: somebody still looks at it
  EXPECT_NE(Decode(decoder, other.frames).cause.data, held.data);
}

// A pixel for each phase of the finest fringes, many times, so that bins of it can be compared with the
// formula.
Columns Sweep(cv::Size size) {
  Columns columns(size);
  cv::RNG random(7);
  random.fill(columns, cv::RNG::UNIFORM, 100.0, 1800.0);
  return columns;
}

// Whole blocks without contrast are not decoded; what they get instead is the same on every path.
TEST(FringeDecoder, WithoutContrastThereIsNoCoordinate) {
  ReconstructionConfig config;
  config.mask_border_px = 0;
  const PatternSet pattern = StationPattern(Background::kShared);
  const StationScene scene = RenderStation({613, 301}, pattern, config.noise);
  std::vector<cv::Mat> frames = scene.frames;
  for (cv::Mat& frame : frames) {
    frame(cv::Rect(0, 0, 20, 301)) = 250;
  }
  const DecodedView view = Decode(Decoder(pattern, config), frames);
  long without = 0;
  for (int row = 0; row < view.cause.rows; ++row) {
    for (int column = 0; column < view.cause.cols; ++column) {
      const auto cause = static_cast<MaskCause>(view.cause(row, column));
      const bool is_nan = std::isnan(view.coordinate_px(row, column));
      ASSERT_EQ(is_nan, cause != MaskCause::kValid);
      without += is_nan;
      if (column < 20) {
        ASSERT_EQ(cause, MaskCause::kSaturated) << row << " " << column;
      } else if (std::isnan(scene.columns(row, column))) {
        ASSERT_EQ(cause, MaskCause::kLowModulation) << row << " " << column;
      }
    }
  }
  EXPECT_GT(without, view.cause.rows * view.cause.cols / 20);
}

// The rule for dark blocks drops no pixel that the plain arithmetic keeps.
TEST(FringeDecoder, DimFringesAreKeptAsByThePlainArithmetic) {
  ReconstructionConfig config;
  config.noise = {.read_noise_dn = 0.4, .gain_dn = 0};
  config.max_phase_sigma_rad = 0.2;
  config.mask_border_px = 0;
  const PatternSet pattern = StationPattern(Background::kShared);
  const Columns columns = Sweep({640, 200});
  const auto kept = [&](double modulation_dn, std::optional<SimdPath> path) {
    const auto frames = RenderColumns(
        columns, pattern, {.background_dn = 60, .modulation_dn = modulation_dn, .noise = config.noise});
    return static_cast<double>(Decode(Decoder(pattern, config, path), frames).count[0]) /
           static_cast<double>(columns.total());
  };
  for (const double modulation_dn : {6.0, 7.0, 7.5, 8.0, 8.5, 9.0, 10.0}) {
    EXPECT_NEAR(kept(modulation_dn, BestSimdPath()), kept(modulation_dn, std::nullopt), 0.01)
        << modulation_dn;
  }
  EXPECT_GT(kept(11, BestSimdPath()), 0.99);
  EXPECT_LT(kept(6, BestSimdPath()), 0.01);
}

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

TEST(FringeDecoder, NamesTheCause) {
  ReconstructionConfig config;
  config.mask_border_px = 0;
  const PatternSet pattern = StationPattern(Background::kShared);
  const Columns columns = Sweep({64, 64});
  for (const auto path : {std::optional(BestSimdPath()), std::optional<SimdPath>()}) {
    const FringeDecoder decoder = Decoder(pattern, config, path);
    const auto most = [&](const PhaseLighting& lighting, const auto& spoil) {
      auto frames = RenderColumns(columns, pattern, lighting);
      spoil(frames);
      const auto count = Decode(decoder, frames).count;
      return static_cast<MaskCause>(std::ranges::max_element(count) - count.begin());
    };
    const auto nothing = [](std::vector<cv::Mat>&) {};
    EXPECT_EQ(most({}, nothing), MaskCause::kValid);
    EXPECT_EQ(most({.background_dn = 200, .modulation_dn = 80}, nothing), MaskCause::kSaturated);
    EXPECT_EQ(most({.modulation_dn = 4}, nothing), MaskCause::kLowModulation);
    EXPECT_EQ(most({.modulation_dn = 12}, nothing), MaskCause::kNoisy);
    EXPECT_EQ(most({}, [](auto& frames) { frames[7] = 0.7 * frames[7]; }), MaskCause::kReference);
    EXPECT_EQ(most({}, [](auto& frames) { frames[0] = 0.3 * frames[0]; }), MaskCause::kModulationRatio);
  }
}

}  // namespace
}  // namespace forgescan
