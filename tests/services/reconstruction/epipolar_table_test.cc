#include "services/reconstruction/epipolar_table.h"

#include <gtest/gtest.h>

#include <cmath>
#include <opencv2/core.hpp>

namespace forgescan {
namespace {

// Lines that run along raw rows, or leave one so slowly that rounding says on which side of it they are.
EpipolarTable TableOf(double tilt_rad, ImageSize size) {
  CameraIntrinsics camera;
  camera.camera_matrix << 900, 0, 160, 0, 900, 120, 0, 0, 1;
  camera.distortion = {0, 0, 0, 0, 0};
  const double c = std::cos(tilt_rad), s = std::sin(tilt_rad);
  const cv::Mat rectification = (cv::Mat_<double>(3, 3) << c, -s, 0, s, c, 0, 0, 0, 1);
  const cv::Mat projection = (cv::Mat_<double>(3, 4) << 900, 0, 160, 0, 0, 900, 120, 0, 0, 0, 1, 0);
  auto table = EpipolarTable::Build(camera, rectification, projection, size);
  EXPECT_TRUE(table.ok());
  return std::move(table).value();
}

// In single precision, as the kernels do.
float LineAt(const EpipolarBlock& block, int lane) {
  const auto x = static_cast<float>(lane);
  return block.row[0] + x * (block.row[1] + x * block.row[2]);
}

TEST(EpipolarTable, ALineOnARawRowLosesNoPixel) {
  constexpr ImageSize kSize = {320, 240};
  for (const double tilt_rad : {0.0, 1e-9, 1e-7, -1e-7, 1e-6, 3e-5, -1e-4}) {
    const EpipolarTable table = TableOf(tilt_rad, kSize);
    for (int row = 1; row < kSize.height_px - 2; ++row) {
      for (int x = 1; x < kSize.width_px - 1; ++x) {
        const EpipolarBlock& block = table.Row(row)[x / kStereoLanes];
        const float line = LineAt(block, x % kStereoLanes);
        ASSERT_GE(line, 0) << tilt_rad << " row " << row << " column " << x;
        ASSERT_LT(line, static_cast<float>(block.row_count)) << tilt_rad << " row " << row << " column " << x;
        ASSERT_LE(block.first_row + block.row_count, kSize.height_px - 1);
        ASSERT_NEAR(block.first_row + line, row, 0.05);  // px: 1e-4 rad over 320 px
      }
    }
  }
}

}  // namespace
}  // namespace forgescan
