// Sampling and normals of stereo: what they do, and that every instruction set does the same to the last bit.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <limits>
#include <random>

#include "services/reconstruction/decoded_view.h"
#include "services/reconstruction/stereo/kernel.h"
#include "services/reconstruction/stereo/row_arrays.h"

namespace forgescan {
namespace {

constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
constexpr float kVariance = 0.0004F;
using Row = std::vector<float>;

const StereoKernel& Plain() { return *StereoKernels().back(); }

// Lines that slant through an image of odd width, with masked pixels, jumps and lines that leave the image.
// extra_rows: that the blocks' lists of rows are too long by.
struct Lines {
  float slant = 0.1F;
  bool is_listed_closely = false;
  int extra_rows = 0;
};

EpipolarBlock BlockOf(const Lines& lines, int height, float row, int block) {
  EpipolarBlock result = {
      {row, lines.slant, lines.slant / 100}, {static_cast<float>(16 * block), 1.01F, 0.0001F}, 0, 0};
  if (!lines.is_listed_closely) {
    result.row_count = static_cast<std::uint16_t>(height - 1);
    return result;
  }
  const int first = std::max(static_cast<int>(std::floor(row)), 0);
  const int last = std::min(static_cast<int>(std::floor(row + 17.25F * lines.slant)), height - 2);
  if (last >= first) {
    result.row[0] -= static_cast<float>(first);
    result.first_row = static_cast<std::uint16_t>(first);
    result.row_count =
        static_cast<std::uint16_t>(std::min(last - first + 1 + lines.extra_rows, height - 1 - first));
  }
  return result;
}

Row SampleAll(const StereoKernel& kernel, const Lines& lines) {
  constexpr int kWidth = 53, kHeight = 20, kBlocks = 4;
  std::mt19937 random(9);
  std::uniform_real_distribution<float> uniform(0, 1);
  std::vector<float> coordinate(kWidth * kHeight);
  std::vector<std::uint16_t> variance(kWidth * kHeight);
  for (std::size_t i = 0; i < coordinate.size(); ++i) {
    coordinate[i] =
        static_cast<float>(i % kWidth) + 0.1F * uniform(random) + (uniform(random) > 0.95F ? 9.0F : 0.0F);
    const float sigma = 0.02F + 0.01F * uniform(random);
    variance[i] = UpperOfFloat(sigma * sigma);
    coordinate[i] = uniform(random) > 0.9F ? kNan : coordinate[i];
  }
  const RawView view = {coordinate.data(), variance.data(), kWidth, kWidth, kWidth, kHeight, 3, -1};
  Row all;
  for (int row = -2; row < kHeight; ++row) {
    std::vector<EpipolarBlock> blocks(kBlocks);
    for (int b = 0; b < kBlocks; ++b) {
      const float begin = static_cast<float>(row) + 0.3F + 16 * lines.slant * static_cast<float>(b);
      blocks[static_cast<std::size_t>(b)] = BlockOf(lines, kHeight, begin, b);
    }
    RowArrays arrays(3, kBlocks * kStereoLanes);
    PreparedRow prepared(kBlocks, arrays[0], arrays[1], arrays[2]);
    kernel.sample(view, blocks.data(), prepared.row());
    for (int x = 0; x < kWidth; ++x) {
      const bool has_value = !std::isnan(prepared.row().raw_px[x]);
      all.push_back(prepared.row().raw_px[x]);
      all.push_back(has_value ? prepared.row().variance_px2[x] : 0);
      all.push_back(prepared.row().column_px[x]);
    }
  }
  return all;
}

TEST(StereoKernel, SamplesBetweenValidRowsOnly) {
  for (const Lines& lines : {Lines{}, Lines{.slant = 0.03F, .is_listed_closely = true}}) {
    const Row plain = SampleAll(Plain(), lines);
    const auto numbers = std::count_if(plain.begin(), plain.end(), [](float v) { return !std::isnan(v); });
    EXPECT_LT(numbers, std::ssize(plain));
    EXPECT_GT(numbers, std::ssize(plain) / 2);
    for (std::size_t i = 0; i < plain.size(); i += 3) {
      ASSERT_TRUE(std::isnan(plain[i]) || (plain[i] <= 0 && plain[i] > -64))
          << i;  // sign -1; 9 px jumps are not mixed in
    }
    for (const StereoKernel* kernel : StereoKernels()) {
      const Row other = SampleAll(*kernel, lines);
      EXPECT_EQ(std::memcmp(plain.data(), other.data(), plain.size() * sizeof(float)), 0) << kernel->name;
    }
  }
}

// One or two rows are taken at once, more of them one by one.
TEST(StereoKernel, SamplesTheSameHoweverManyRowsAreListed) {
  for (const StereoKernel* kernel : StereoKernels()) {
    const Row close = SampleAll(*kernel, {.slant = 0.03F, .is_listed_closely = true});
    const Row loose = SampleAll(*kernel, {.slant = 0.03F, .is_listed_closely = true, .extra_rows = 3});
    EXPECT_EQ(std::memcmp(close.data(), loose.data(), close.size() * sizeof(float)), 0) << kernel->name;
  }
}

// Disparities of a plane with holes and a step, 9 rows of 64.
Row TriangulateAll(const StereoKernel& kernel, bool with_holes) {
  constexpr int kRows = 9, kBlocks = 4, kCount = kBlocks * kStereoLanes, kRoom = kCount + kStereoLanes;
  RowArrays disparities(kRows, kCount), scratch(6, kCount);
  for (int y = 0; y < kRows; ++y) {
    for (int x = 0; x < kCount; ++x) {
      const bool hole = with_holes && ((x + 3 * y) % 11 == 0 || (x > 30 && x < 33));
      disparities[y][x] = hole ? kNan : 200 + 0.05F * static_cast<float>(x) - 0.02F * static_cast<float>(y);
    }
  }
  PreparedRow left(kBlocks, scratch[0], scratch[1], scratch[2]);
  std::vector<EpipolarBlock> blocks(kBlocks);
  for (int x = 0; x < kCount; ++x) {
    scratch[0][x] = scratch[2][x] = static_cast<float>(x - 32);
    scratch[1][x] = scratch[3][x] = kVariance;
    blocks[static_cast<std::size_t>(x / kStereoLanes)] = {
        {4, 0, 0}, {static_cast<float>(x / 16 * 16 - 32), 1, 0}, 4, 1};
  }
  std::vector<const float*> rows;
  for (int y = 1; y < kRows - 1; ++y) {
    rows.push_back(disparities[y]);
  }
  const DisparityRow disparity = {disparities[4], scratch[3]};
  Row out(9 * kRoom, 0);
  float* const at = out.data();
  alignas(64) std::array<float, 3 * kRoom> target{};
  PointRow points = {{at, target.data(), 0},
                     {at + 3 * kRoom, nullptr, 0},
                     {at + 6 * kRoom, nullptr, 0},
                     at + 7 * kRoom,
                     at + 8 * kRoom,
                     0,
                     0,
                     0,
                     0,
                     0,
                     0};
  const std::vector<EpipolarBlock> nothing(kBlocks);  // to fetch ahead
  kernel.triangulate({rows.data(),
                      &left.row(),
                      &disparity,
                      blocks.data(),
                      blocks.data(),
                      blocks.data(),
                      scratch[4],
                      scratch[5],
                      kBlocks,
                      {nullptr, nothing.data()}},
                     {0.001F, 100000, 5, 50, 10000, 0.117F, 0.003F, 3, 1, nullptr}, points);
  EXPECT_EQ(points.points_mm.streamed, 3 * points.count / 16 * 16);  // whole lines
  EXPECT_TRUE(std::equal(at, at + points.points_mm.streamed, target.begin())) << kernel.name;
  // Behind the points stands whatever was packed last.
  std::fill(at + 3 * points.count, at + 3 * kRoom, 0.0F);
  std::fill(at + 3 * kRoom + 3 * points.count, at + 6 * kRoom, 0.0F);
  for (int i = 6; i < 9; ++i) {
    std::fill(at + i * kRoom + points.count, at + (i + 1) * kRoom, 0.0F);
  }
  out.push_back(static_cast<float>(points.count));
  out.push_back(static_cast<float>(points.no_normal));
  return out;
}

TEST(StereoKernel, NormalsOfAPlaneAreItsNormalWithHolesOrWithout) {
  constexpr int kRoom = 80;
  for (const bool with_holes : {false, true}) {
    const Row plain = TriangulateAll(Plain(), with_holes);
    const auto count = static_cast<int>(plain[plain.size() - 2]);
    EXPECT_GT(count, with_holes ? 40 : 55);
    // d = (f b / c) n.ray: n is along (gx, gy, d/f - gx x - gy y) of any of the pixels.
    const double gx = 0.05, gy = -0.02, gz = (200 + 0.05 * 32 - 0.02 * 4) / 1000 - gy * 5 / 1000;
    const double length = std::sqrt(gx * gx + gy * gy + gz * gz);
    for (int i = 0; i < count; ++i) {
      const float* const normal = plain.data() + 3 * kRoom + 3 * i;
      ASSERT_NEAR(normal[0], -gx / length, 2e-5) << i;  // float disparities of 200 px: 1.5e-5 px
      ASSERT_NEAR(normal[1], -gy / length, 2e-5) << i;
      ASSERT_NEAR(normal[2], -gz / length, 2e-5) << i;
    }
    for (const StereoKernel* kernel : StereoKernels()) {
      const Row other = TriangulateAll(*kernel, with_holes);
      EXPECT_EQ(std::memcmp(plain.data(), other.data(), plain.size() * sizeof(float)), 0) << kernel->name;
    }
  }
}

}  // namespace
}  // namespace forgescan
