#include "services/reconstruction/mask_border.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <opencv2/core.hpp>

namespace forgescan {
namespace {

constexpr auto kBorder = static_cast<std::uint8_t>(MaskCause::kBorder);

cv::Mat_<std::uint8_t> SparseMask(cv::Size size) {
  cv::Mat_<std::uint8_t> cause(size, std::uint8_t{0});
  cv::RNG random(3);
  for (int i = 0; i < size.area() / 150 + 1; ++i) {
    cause(random.uniform(0, size.height), random.uniform(0, size.width)) =
        static_cast<std::uint8_t>(random.uniform(1, kMaskCauses - 1));
  }
  return cause;
}

cv::Mat_<std::uint8_t> Widened(const cv::Mat_<std::uint8_t>& cause, int radius) {
  cv::Mat_<std::uint8_t> wide = cause.clone();
  for (int row = 0; row < cause.rows; ++row) {
    for (int column = 0; column < cause.cols; ++column) {
      const cv::Range rows(std::max(row - radius, 0), std::min(row + radius + 1, cause.rows));
      const cv::Range columns(std::max(column - radius, 0), std::min(column + radius + 1, cause.cols));
      if (cause(row, column) == 0 && cv::countNonZero(cause(rows, columns)) > 0) {
        wide(row, column) = kBorder;
      }
    }
  }
  return wide;
}

MaskMap MapOf(const cv::Mat_<std::uint8_t>& cause) {
  MaskMap masked(cause.size());
  for (int row = 0; row < cause.rows; ++row) {
    masked.SetRow(row, cause[row]);
  }
  return masked;
}

TEST(MaskMap, CountsEveryCauseAlsoInLongRunsOfOne) {
  cv::Mat_<std::uint8_t> cause = SparseMask({333, 40});
  cause(cv::Rect(100, 5, 220, 30)) = static_cast<std::uint8_t>(MaskCause::kNoisy);
  cause(33, 150) = static_cast<std::uint8_t>(MaskCause::kUnwrapMargin);
  MaskMap masked = MapOf(cause);
  masked.Unmask(33, 150, MaskCause::kUnwrapMargin);
  cause(33, 150) = 0;
  const auto counts = masked.CountByCause();
  for (int one = 0; one < kMaskCauses; ++one) {
    EXPECT_EQ(counts[static_cast<std::size_t>(one)], cv::countNonZero(cause == one));
  }
  for (int row = 0; row < cause.rows; ++row) {
    for (int column = 0; column < cause.cols; ++column) {
      const std::uint64_t word = masked.Row(row)[column / MaskMap::kWordPx];
      ASSERT_EQ(word >> (column % MaskMap::kWordPx) & 1, cause(row, column) != 0) << row << " " << column;
    }
  }
}

TEST(MaskBorder, IsWhatLookingAtEveryNeighbourGives) {
  for (const cv::Size size : {cv::Size(200, 150), cv::Size(67, 64), cv::Size(9, 3), cv::Size(1, 70)}) {
    for (const int radius : {0, 1, 2, 3, 5}) {
      for (const int threads : {1, 2, 5}) {
        SCOPED_TRACE(testing::Message() << size << " radius " << radius << " threads " << threads);
        ReconstructionConfig config;
        config.mask_border_px = radius;
        config.threads = threads;
        DecodedView view;
        view.cause = SparseMask(size);
        view.coordinate_px = cv::Mat_<float>(size, 7.0F);
        const cv::Mat_<std::uint8_t> wanted = Widened(view.cause, radius);
        MaskMap masked = MapOf(view.cause);
        DropMaskBorder(config, masked, view);
        ASSERT_EQ(cv::countNonZero(view.cause != wanted), 0);
        for (int i = 0; i < size.area(); ++i) {
          const int row = i / size.width, column = i % size.width;
          ASSERT_EQ(std::isnan(view.coordinate_px(row, column)), wanted(row, column) == kBorder);
        }
        for (int cause = 0; cause < kMaskCauses; ++cause) {
          ASSERT_EQ(view.count[static_cast<std::size_t>(cause)], cv::countNonZero(wanted == cause));
        }
      }
    }
  }
}

}  // namespace
}  // namespace forgescan
