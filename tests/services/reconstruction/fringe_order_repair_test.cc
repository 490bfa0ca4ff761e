#include "services/reconstruction/fringe_order_repair.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <opencv2/core.hpp>

#include "services/reconstruction/mask_border.h"

namespace forgescan {
namespace {

constexpr float kPeriodPx = 16;
constexpr auto kDoubtful = static_cast<std::uint8_t>(MaskCause::kUnwrapMargin);
constexpr auto kNoisy = static_cast<std::uint8_t>(MaskCause::kNoisy);

float TrueCoordinate(int row, int column) {
  return 100 + 0.5F * static_cast<float>(column) + 0.01F * static_cast<float>(row);
}
float TrueVariance(int row, int column) { return 0.01F + 1e-4F * static_cast<float>(row + column); }

// A smooth surface of which some pixels are doubtful.
struct Scene {
  Scene() {
    view.coordinate_px.create(24, 70);
    view.cause = cv::Mat_<std::uint8_t>(24, 70, std::uint8_t{0});
    view.variance_px2.create(12, 70);
    for (int row = 0; row < 24; ++row) {
      for (int column = 0; column < 70; ++column) {
        view.coordinate_px(row, column) = TrueCoordinate(row, column);
        view.variance_px2(row / 2, column) = UpperOfFloat(TrueVariance(row / 2 * 2, column));
      }
    }
  }

  // Off its true coordinate; on an even row with a variance of its own.
  void Plant(int row, int column, float off_px) {
    view.coordinate_px(row, column) += off_px;
    view.cause(row, column) = kDoubtful;
    if (row % 2 == 0) view.variance_px2(row / 2, column) = UpperOfFloat(9);
    doubtful_rows[static_cast<std::size_t>(row)] = 1;
  }
  void Mask(const cv::Rect& area) {
    view.cause(area) = kNoisy;
    view.coordinate_px(area) = std::nanf("");
  }

  // Of the repair, and of the border after it.
  long Finish(int threads) {
    ReconstructionConfig config;
    config.threads = threads;
    config.mask_border_px = 1;
    MaskMap masked(view.cause.size());
    for (int row = 0; row < view.cause.rows; ++row) masked.SetRow(row, view.cause[row]);
    const long repaired = RepairFringeOrders(doubtful_rows, kPeriodPx, config, masked, view);
    DropMaskBorder(config, masked, view);
    return repaired;
  }

  long CountOf(MaskCause cause) const { return view.count[static_cast<std::size_t>(cause)]; }

  DecodedView view;
  std::vector<std::uint8_t> doubtful_rows = std::vector<std::uint8_t>(24, 0);
};

struct Planted {
  int row, column;
  float periods;
};
constexpr Planted kPlanted[] = {{4, 10, 1}, {7, 20, -2}, {12, 63, 1}, {13, 64, -1}, {0, 0, 3}, {23, 69, 1}};

// Inside the image, at the edge of a word of the mask, side by side over a corner, and in the corners.
TEST(FringeOrderRepair, StartsAndMovesDoubtfulPixelsByWholePeriods) {
  for (const int threads : {1, 2, 4}) {
    Scene scene;
    for (const auto& [row, column, periods] : kPlanted) {
      scene.Plant(row, column, periods * kPeriodPx);
    }
    EXPECT_EQ(scene.Finish(threads), static_cast<long>(std::size(kPlanted)));
    for (int row = 0; row < 24; ++row) {
      for (int column = 0; column < 70; ++column) {
        SCOPED_TRACE(testing::Message() << row << " " << column << ", threads " << threads);
        ASSERT_EQ(scene.view.cause(row, column), 0);  // no border either
        ASSERT_NEAR(scene.view.coordinate_px(row, column), TrueCoordinate(row, column),
                    1e-4);  // px; rounding
      }
    }
    EXPECT_EQ(scene.CountOf(MaskCause::kValid), 24 * 70);
    EXPECT_EQ(scene.CountOf(MaskCause::kUnwrapMargin), 0);
    EXPECT_EQ(scene.CountOf(MaskCause::kBorder), 0);
  }
}

// Of the even rows, which are the only ones that have variances: two rows and columns on.
TEST(FringeOrderRepair, TheVarianceIsTheLargestOfTheNeighbours) {
  Scene scene;
  scene.Plant(4, 10, kPeriodPx);
  scene.Plant(13, 30, -kPeriodPx);
  const cv::Mat_<std::uint16_t> before = scene.view.variance_px2.clone();
  EXPECT_EQ(scene.Finish(1), 2);
  EXPECT_EQ(scene.view.variance_px2(2, 10), UpperOfFloat(TrueVariance(6, 12)));
  scene.view.variance_px2(2, 10) = before(2, 10);
  EXPECT_EQ(cv::countNonZero(scene.view.variance_px2 != before), 0);  // that of row 12 is for its own pixel
}

TEST(FringeOrderRepair, WhatItsNeighboursDoNotExplainStaysMasked) {
  Scene scene;
  scene.Plant(4, 10, 0.4F * kPeriodPx);  // 0.2 periods are allowed
  scene.Plant(9, 40, 1.6F * kPeriodPx);
  scene.Mask({54, 14, 7, 7});
  for (const int row : {16, 17}) scene.Plant(row, 57, kPeriodPx);  // no valid neighbour
  EXPECT_EQ(scene.Finish(1), 0);
  for (const auto& [row, column] : {std::pair(4, 10), {9, 40}, {16, 57}, {17, 57}}) {
    EXPECT_EQ(scene.view.cause(row, column), kDoubtful);
    EXPECT_TRUE(std::isnan(scene.view.coordinate_px(row, column))) << row;
  }
  EXPECT_EQ(scene.CountOf(MaskCause::kUnwrapMargin), 4);
  EXPECT_EQ(scene.CountOf(MaskCause::kBorder), 8 + 8 + 4 * 8);
}

// The first has the six valid neighbours it needs, the second five and the first.
TEST(FringeOrderRepair, ARepairedPixelIsNoNeighbourOfTheNext) {
  Scene scene;
  scene.Mask({20, 6, 9, 9});
  for (const auto& [row, column] :
       {std::pair(8, 22), {9, 22}, {9, 23}, {9, 24}, {9, 25}, {9, 26}, {9, 27}, {10, 24}, {10, 25}}) {
    scene.view.cause(row, column) = 0;
    scene.view.coordinate_px(row, column) = TrueCoordinate(row, column);
  }
  for (const int column : {24, 25}) scene.Plant(10, column, kPeriodPx);
  EXPECT_EQ(scene.Finish(1), 1);
  EXPECT_EQ(scene.view.cause(10, 25), kDoubtful);
  EXPECT_EQ(scene.CountOf(MaskCause::kUnwrapMargin), 1);
}

}  // namespace
}  // namespace forgescan
