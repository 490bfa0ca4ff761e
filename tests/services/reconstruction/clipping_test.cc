#include "services/reconstruction/clipping.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <opencv2/core.hpp>
#include <utility>

#include "services/reconstruction/fringe_decoder.h"
#include "tests/services/reconstruction/phase_scene.h"

namespace forgescan {
namespace {

// One frame of ideal fringes, 100 +- 80 DN, cut at level_dn; factor: to 16 bit.
std::vector<cv::Mat> Fringes(double level_dn, int type, double factor) {
  cv::Mat_<double> fringes(200, 300);
  for (int row = 0; row < fringes.rows; ++row) {
    for (int column = 0; column < fringes.cols; ++column) {
      fringes(row, column) =
          factor * std::round(std::min(level_dn, 100 + 80 * std::cos(0.3 * column + 0.01 * row)));
    }
  }
  cv::Mat frame;
  fringes.convertTo(frame, type);
  return {frame};
}

TEST(Clipping, StartsAndFindsTheLevel) {
  const PatternSet pattern;
  EXPECT_EQ(FindClippingLevel(Fringes(150, CV_8U, 1), pattern, 1), 150);
  EXPECT_EQ(FindClippingLevel(Fringes(150, CV_16U, 16), pattern, 2), 2400);  // steps of 16
}

TEST(Clipping, CrestsOfIdealFringesAreNotCut) {
  const PatternSet pattern;
  EXPECT_FALSE(FindClippingLevel(Fringes(255, CV_8U, 1), pattern, 1).has_value());
  EXPECT_FALSE(FindClippingLevel(Fringes(255, CV_16U, 16), pattern, 1).has_value());
}

TEST(Clipping, NeitherHotPixelsNorConstantFramesNorTheWhiteFrameAreACut) {
  auto hot = Fringes(255, CV_8U, 1);
  hot[0].at<std::uint8_t>(100, 100) = 230;
  PatternSet pattern;
  EXPECT_FALSE(FindClippingLevel(hot, pattern, 1).has_value());
  EXPECT_FALSE(
      FindClippingLevel(std::vector{cv::Mat(50, 50, CV_8U, cv::Scalar(90))}, pattern, 1).has_value());
  auto with_white = Fringes(255, CV_8U, 1);
  with_white.emplace_back(200, 300, CV_8U, cv::Scalar(200));
  pattern.reference_frame_index = 1;
  EXPECT_FALSE(FindClippingLevel(with_white, pattern, 1).has_value());
}

TEST(Clipping, ALevelBetweenTheLimitOfSaturationAndFullScaleIsKept) {
  const PatternSet pattern = StationPattern(Background::kShared);
  ReconstructionConfig config;  // saturated above 242.25 DN
  config.noise = {.read_noise_dn = 1, .gain_dn = 0};
  Columns columns(120, 300);
  cv::RNG(7).fill(columns, cv::RNG::UNIFORM, 100.0, 1800.0);
  auto frames = RenderColumns(columns, pattern, {.background_dn = 170, .modulation_dn = 80});
  const auto decoder = FringeDecoder::Create(pattern, config);
  EXPECT_FALSE(decoder->Decode(frames)->clipping_dn.has_value());  // at full scale
  for (cv::Mat& frame : frames) {
    frame = cv::min(frame, 245);
  }
  EXPECT_NEAR(decoder->Decode(frames)->clipping_dn.value(), 245, 0.01);  // DN, single precision
}

TEST(Clipping, OfTheReferenceIsAPileAtItsTopOrOneValue) {
  Histogram lit(256);
  EXPECT_FALSE(ReferenceClippingLevel(lit).has_value());  // nothing lit
  for (int value = 150; value <= 200; ++value) {
    lit[static_cast<std::size_t>(value)] = 100;
  }
  EXPECT_FALSE(ReferenceClippingLevel(lit).has_value());
  lit[200] = 5000;
  EXPECT_EQ(ReferenceClippingLevel(lit), 200);
  Histogram plain(256);
  plain[168] = 20000;
  EXPECT_EQ(ReferenceClippingLevel(plain), 168);
  for (const auto& [value, count] :
       {std::pair(166, 1500), {167, 7000}, {168, 9000}, {169, 2300}, {170, 200}}) {
    plain[static_cast<std::size_t>(value)] = count;  // flat, but with noise
  }
  EXPECT_FALSE(ReferenceClippingLevel(plain).has_value());
}

}  // namespace
}  // namespace forgescan
