#include "services/reconstruction/clipping.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <opencv2/core.hpp>

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

}  // namespace
}  // namespace forgescan
