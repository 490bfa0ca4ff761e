#include "services/reconstruction/fringe_order_table.h"

#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <numbers>
#include <opencv2/imgcodecs.hpp>

#include "services/reconstruction/fringe_decoder.h"
#include "tests/common/real_data.h"

namespace forgescan {
namespace {

PatternSet Periods(int width_px, std::vector<double> periods_px) {
  PatternSet pattern;
  pattern.projector_width_px = width_px;
  for (const double period_px : periods_px) {
    FringeFrequency frequency{.period_px = period_px, .frame_index = {}, .shift_rad = {}};
    for (int i = 0; i < 4; ++i) {
      frequency.frame_index.push_back(pattern.frame_count());
      frequency.shift_rad.push_back(i * std::numbers::pi / 2);
      pattern.frame_names.push_back(fmt::format("{:02}.png", pattern.frame_count()));
    }
    pattern.frequencies.push_back(frequency);
  }
  return pattern;
}

double Turns(double coordinate_px, double period_px) {
  const double turns = coordinate_px / period_px;
  return turns - std::floor(turns);
}

// Every column of the field that is not dead gets its order back, for whole and for broken fringe counts.
TEST(FringeOrderTable, FindsEveryOrder) {
  for (const auto& pattern : {Periods(1280, {20, 1280.0 / 63, 1280.0 / 56}), Periods(1280, {28, 26, 24}),
                              Periods(512, {26, 27.37, 32.5}), Periods(640, {64, 71.1})}) {
    const auto table = MakeFringeOrderTable(pattern, 0.15, 0.03);
    ASSERT_TRUE(table.ok()) << table.error().message;
    const auto period = [&](int j) { return pattern.frequencies[static_cast<std::size_t>(j)].period_px; };
    for (double x = static_cast<double>(table->first_px) + 1; x < static_cast<double>(table->last_px) - 1;
         x += 0.3) {
      const double base = Turns(x, period(table->base));
      const double r1 = Turns(x, period(table->others[0])) - static_cast<double>(table->ratios[0]) * base;
      const double r2 = table->other_count < 2 ? 0
                                               : Turns(x, period(table->others[1])) -
                                                     static_cast<double>(table->ratios[1]) * base;
      const auto entry = table->Look(static_cast<float>(r1), static_cast<float>(r2));
      ASSERT_EQ(entry.order, std::floor(x / period(table->base))) << x;
      ASSERT_EQ(entry.is_doubtful, 0) << x;
    }
  }
}

TEST(FringeOrderTable, KeepsTheEdgesDeadOnlyWhereOrdersWrap) {
  const auto wraps = MakeFringeOrderTable(Periods(1280, {20, 1280.0 / 63, 1280.0 / 56}), 0.15, 0.03);
  EXPECT_NEAR(wraps->first_px, 0.03 * 1280 - 0.5, 1e-3);
  const auto does_not = MakeFringeOrderTable(Periods(1280, {28, 26, 24}), 0.15, 0.03);
  EXPECT_EQ(does_not->first_px, -0.5F);
}

TEST(FringeOrderTable, RefusesPeriodsThatAreAmbiguousInTheField) {
  EXPECT_EQ(MakeFringeOrderTable(Periods(1280, {20, 40, 80}), 0.15, 0.03).error().code,
            ErrorCode::kDegenerate);
  EXPECT_EQ(MakeFringeOrderTable(Periods(1280, {28, 26}), 0.15, 0.03).error().code, ErrorCode::kDegenerate);
}

// A rendered bust by others; the published unwrapped phase of the 64-period set at row 470, column 590.
TEST(FringeDecoder, AgreesWithAPublishedPhase) {
  const auto found = RealData("rendered-fringe");
  if (!found.has_value()) {
    GTEST_SKIP() << "rendered-fringe" << kNoRealData;
  }
  const std::filesystem::path& directory = *found;
  PatternSet pattern = Periods(1920, {30, 1920.0 / 58, 1920.0 / 53});
  for (auto& frequency : pattern.frequencies) {  // the phase runs -pi..pi inside each period
    for (double& shift_rad : frequency.shift_rad) {
      shift_rad -= std::numbers::pi;
    }
  }
  ReconstructionConfig config;
  config.saturation_fraction = 1;  // rendered with B = A = 127.5: its white is the full scale by design
  const auto decoder = FringeDecoder::Create(pattern, config);
  ASSERT_TRUE(decoder.ok()) << decoder.error().message;
  std::vector<cv::Mat> frames;
  for (const auto& name : pattern.frame_names) {
    frames.push_back(cv::imread((directory / name).string(), cv::IMREAD_GRAYSCALE));
  }
  const auto view = decoder->Decode(frames);
  ASSERT_TRUE(view.ok()) << view.error().message;
  EXPECT_EQ(view->cause(470, 590), static_cast<int>(MaskCause::kValid));
  const double phase_rad = 2 * std::numbers::pi * static_cast<double>(view->coordinate_px(470, 590)) / 30;
  EXPECT_NEAR(phase_rad, 191.95, 0.1);  // rad, as published
}

}  // namespace
}  // namespace forgescan
