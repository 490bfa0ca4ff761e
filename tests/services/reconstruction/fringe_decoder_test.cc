// Decoding of the station's frames: what it keeps, and that every path gives the same.
#include "services/reconstruction/fringe_decoder.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <opencv2/core.hpp>
#include <optional>

#include "tests/services/reconstruction/decoded_phases.h"

namespace forgescan {
namespace {

constexpr auto kValid = static_cast<std::uint8_t>(MaskCause::kValid);

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
