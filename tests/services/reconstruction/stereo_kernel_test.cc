// The loops of stereo on single rows: what they do, and that every instruction set does the same to the last
// bit.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <random>

#include "services/reconstruction/stereo/kernel.h"
#include "services/reconstruction/stereo/row_arrays.h"

namespace forgescan {
namespace {

constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
constexpr float kVariance = 0.0004F;
constexpr SlopeLimits kLimits = {0.3F, 3.0F, 0.3F};
using Row = std::vector<float>;

Row Ramp(int count, float first, float step) {
  Row row;
  for (int i = 0; i < count; ++i) {
    row.push_back(first + step * static_cast<float>(i));
  }
  return row;
}

int BlocksOf(const Row& row) { return static_cast<int>(row.size() + kStereoLanes - 1) / kStereoLanes; }

// A row as sampling leaves it, rectified columns equal to raw ones, and then prepared.
struct Line {
  Line(const StereoKernel& kernel, const Row& coordinates, int blocks, SlopeLimits limits)
      : arrays(3, blocks * kStereoLanes), prepared(blocks, arrays[0], arrays[1], arrays[2]) {
    StereoRow& row = prepared.row();
    for (int x = 0; x < blocks * kStereoLanes; ++x) {
      const auto at = static_cast<std::size_t>(x);
      row.raw_px[x] = at < coordinates.size() ? coordinates[at] : kNan;
      row.variance_px2[x] = kVariance;
      row.column_px[x] = static_cast<float>(x);
    }
    kernel.prepare(blocks, limits, row);
  }

  RowArrays arrays;
  PreparedRow prepared;
};

struct Matched {
  Row disparity_px, variance_px2;
  MatchCounts counts;
};

Matched MatchRows(const StereoKernel& kernel, const Row& left, const Row& right,
                  SlopeLimits limits = kLimits) {
  const int blocks = std::max(BlocksOf(left), BlocksOf(right));
  Line left_line(kernel, left, blocks, limits), right_line(kernel, right, blocks, limits);
  const std::vector<EpipolarBlock> nothing(static_cast<std::size_t>(blocks));  // to fetch ahead
  std::vector<MatchHint> hints(static_cast<std::size_t>(blocks), MatchHint{-7, {-7, 99, 31}});
  const MatchTask task = {.left = &left_line.prepared.row(),
                          .right = &right_line.prepared.row(),
                          .limits = {limits, limits, 0.2F},
                          .blocks = blocks,
                          .next = {nullptr, nothing.data()},
                          .hints = hints.data()};
  Matched matched{Row(static_cast<std::size_t>(blocks * kStereoLanes)),
                  Row(static_cast<std::size_t>(blocks * kStereoLanes)),
                  {}};
  const DisparityRow out = {matched.disparity_px.data(), matched.variance_px2.data()};
  for (int i = 0; i < 2; ++i) {  // the second time with what the first one left as hints
    matched.counts = kernel.match(task, out);
  }
  return matched;
}

const StereoKernel& Plain() { return *StereoKernels().back(); }

TEST(StereoKernel, FindsSubPixelPartners) {
  const auto matched = MatchRows(Plain(), Ramp(90, 103, 0.8F), Ramp(90, 100, 1.2F));
  for (int u = 2; u < 88; ++u) {
    const float partner = (3 + 0.8F * static_cast<float>(u)) / 1.2F;
    ASSERT_NEAR(static_cast<float>(u) - matched.disparity_px[static_cast<std::size_t>(u)], partner, 2e-4)
        << u;  // px, float
  }
  EXPECT_TRUE(std::isnan(matched.disparity_px[0]));  // nothing on its left to close with
  EXPECT_EQ(matched.counts.candidates, 90);
  EXPECT_EQ(matched.counts.ambiguous, 0);
}

TEST(StereoKernel, SmoothingKeepsAParabola) {
  Row bent;
  for (int i = 0; i < 64; ++i) {
    bent.push_back(100 + static_cast<float>(i) + 0.002F * static_cast<float>(i * i));
  }
  Line line(Plain(), bent, 4, kLimits);
  for (int x = 0; x < 64; ++x) {
    ASSERT_NEAR(line.prepared.row().coordinate_px[x], bent[static_cast<std::size_t>(x)], 3e-5);  // px, float
  }
  EXPECT_FLOAT_EQ(line.prepared.row().variance_px2[30], kVariance * 17 / 35);
  EXPECT_FLOAT_EQ(line.prepared.row().variance_px2[1], kVariance);  // one of five is missing
}

TEST(StereoKernel, DropsWhatFitsTwice) {
  const auto left = Ramp(40, 10, 1);
  auto right = Ramp(40, 10.5F, 1);
  right.push_back(kNan);
  const auto again = Ramp(8, 24.2F, 1);  // the columns 24.2 .. 31.2 a second time, as before something thin
  right.insert(right.end(), again.begin(), again.end());
  for (const StereoKernel* kernel : StereoKernels()) {
    const auto matched = MatchRows(*kernel, left, right);
    EXPECT_FALSE(std::isnan(matched.disparity_px[12]));
    for (std::size_t u = 15; u < 21; ++u) {
      EXPECT_TRUE(std::isnan(matched.disparity_px[u])) << u;
    }
    EXPECT_FALSE(std::isnan(matched.disparity_px[23]));
    EXPECT_EQ(matched.counts.ambiguous, 7);
    EXPECT_EQ(MatchRows(*kernel, right, left).counts.ambiguous, 7 + 7);  // both places of the left row
  }
}

TEST(StereoKernel, AFoldIsMatchedWhereItIsUnique) {
  Row folded = Ramp(30, 100, 1);
  for (const float value : Ramp(30, 90, 1)) {  // 100..119 twice
    folded.push_back(value);
  }
  for (const StereoKernel* kernel : StereoKernels()) {
    const auto matched = MatchRows(*kernel, Ramp(50, 85.5F, 1), folded);
    EXPECT_NEAR(matched.disparity_px[8], 8 - 33.5, 1e-4);    // 93.5: in the second part only
    EXPECT_TRUE(std::isnan(matched.disparity_px[20]));       // 105.5: in both
    EXPECT_NEAR(matched.disparity_px[40], 40 - 25.5, 1e-4);  // 125.5: in the first part only
  }
}

TEST(StereoKernel, NeverBridgesAGapOrAJump) {
  const auto left = Ramp(40, 10, 1);
  auto right = Ramp(40, 10.5F, 1);
  right[5] = kNan;  // 15.5
  right[22] += 20;  // a wrong fringe order
  const auto matched = MatchRows(Plain(), left, right);
  EXPECT_TRUE(std::isnan(matched.disparity_px[5]));   // 15 lies between 14.5 and the gap
  EXPECT_TRUE(std::isnan(matched.disparity_px[22]));  // 32 lies before the jump
  EXPECT_FALSE(std::isnan(matched.disparity_px[12]));
  EXPECT_FALSE(std::isnan(matched.disparity_px[27]));
}

TEST(StereoKernel, LeavesOutAPixelThatFliesBetweenSurfaces) {
  auto left = Ramp(40, 10, 1);
  left[20] += 0.7F;
  const auto matched = MatchRows(Plain(), left, Ramp(40, 10.3F, 1), {0.1F, 4, 0.2F});
  EXPECT_TRUE(std::isnan(matched.disparity_px[20]));
  EXPECT_EQ(matched.counts.candidates, 37);  // without it and the two beside it, whose parabolas it bends
  EXPECT_FALSE(std::isnan(matched.disparity_px[12]));
}

TEST(StereoKernel, SlopesOutsideOfTheLimitsAreNoSurface) {
  EXPECT_EQ(MatchRows(Plain(), Ramp(40, 10, 1), Ramp(200, 10, 0.25F)).counts.no_partner, 40);
  EXPECT_EQ(MatchRows(Plain(), Ramp(40, 10, 1), Ramp(20, 10, 3.5F)).counts.no_partner, 40);
  EXPECT_EQ(MatchRows(Plain(), Ramp(40, 10, 0), Ramp(40, 0, 1)).counts.left_right, 40);
}

TEST(StereoKernel, StandsWildCoordinates) {
  const Row wild = {-1e9F, 1e9F, kNan, 5, 5, -0.0F, 1e-30F, 3e38F, -3e38F, kNan, kNan, 7};
  for (const StereoKernel* kernel : StereoKernels()) {
    EXPECT_EQ(MatchRows(*kernel, wild, wild).counts.no_partner, 9);
    EXPECT_EQ(MatchRows(*kernel, Row(48, kNan), wild).counts.candidates, 0);
    Row saw;  // 100 folds: more than a surface has
    for (int i = 0; i < 500; ++i) {
      saw.push_back(static_cast<float>(i % 5));
    }
    EXPECT_EQ(MatchRows(*kernel, Ramp(50, 0, 1), saw).counts.ambiguous, 50);
  }
}

// Independent and slow: every left pixel against every pair of the right row.
Row SlowDisparity(const StereoRow& left, const StereoRow& right, int count) {
  const auto is_pair = [](const StereoRow& row, int v) {
    const float step = row.coordinate_px[v + 1] - row.coordinate_px[v];
    return step >= kLimits.low && step <= kLimits.high;
  };
  const auto holds = [&](const StereoRow& row, int v, float wanted) {
    return is_pair(row, v) && row.coordinate_px[v] <= wanted && wanted < row.coordinate_px[v + 1];
  };
  Row disparity(static_cast<std::size_t>(count), kNan);
  for (int u = 1; u + 1 < count; ++u) {
    const float wanted = left.coordinate_px[u];
    int places = 0, own = 0, at = 0;
    for (int v = 0; v + 1 < count; ++v) {
      own += holds(left, v, wanted) ? 1 : 0;
      places += holds(right, v, wanted) ? 1 : 0;
      at = holds(right, v, wanted) ? v : at;
    }
    if (places != 1 || own != 1 || !is_pair(left, u - 1) || !is_pair(left, u)) {
      continue;
    }
    const double a = wanted - right.coordinate_px[at], b = right.coordinate_px[at + 1] - wanted;
    const double before = wanted - left.coordinate_px[u - 1], behind = left.coordinate_px[u + 1] - wanted;
    if (std::abs(a * b / (a + b) * (1 / behind - 1 / before)) <= 0.2) {
      disparity[static_cast<std::size_t>(u)] = static_cast<float>(u - at - a / (a + b));
    }
  }
  return disparity;
}

// Surfaces with holes, steps forth and back, outliers and noise.
Row RandomRow(std::mt19937& random, int count) {
  std::uniform_real_distribution<float> uniform(0, 1);
  std::normal_distribution<float> noise(0, 0.03F);
  Row row;
  float value = 50 + 20 * uniform(random);
  float slope = 1;
  for (int i = 0; i < count; ++i) {
    const float dice = uniform(random);
    value += dice < 0.01F ? 60 * (uniform(random) - 0.4F) : slope;
    slope = dice > 0.95F ? 0.6F + uniform(random) : slope;
    const float outlier = dice > 0.5F && dice < 0.51F ? 200 * uniform(random) : 0;
    row.push_back(dice > 0.6F && dice < 0.63F ? kNan : value + noise(random) + outlier);
  }
  return row;
}

TEST(StereoKernel, AgreesWithTheSlowSearchOnRandomRows) {
  std::mt19937 random(5);
  long compared = 0;
  for (int i = 0; i < 60; ++i) {
    const Row left = RandomRow(random, 300), right = RandomRow(random, 300);
    const int blocks = BlocksOf(left);
    Line left_line(Plain(), left, blocks, kLimits), right_line(Plain(), right, blocks, kLimits);
    const Row slow =
        SlowDisparity(left_line.prepared.row(), right_line.prepared.row(), blocks * kStereoLanes);
    const Matched fast = MatchRows(Plain(), left, right);
    for (std::size_t u = 0; u < slow.size(); ++u) {
      ASSERT_EQ(std::isnan(slow[u]), std::isnan(fast.disparity_px[u])) << "row " << i << ", pixel " << u;
      if (!std::isnan(slow[u])) {
        ASSERT_NEAR(slow[u], fast.disparity_px[u], 1e-3);  // px, float coordinates of some hundreds
        ++compared;
      }
    }
  }
  EXPECT_GT(compared, 2000);
}

TEST(StereoKernel, EveryInstructionSetGivesTheSameBits) {
  std::mt19937 random(7);
  for (int i = 0; i < 40; ++i) {
    const Row left = RandomRow(random, 700),
              right = i % 3 == 0 ? Ramp(700, 40, 0.9F) : RandomRow(random, 700);
    const Matched plain = MatchRows(Plain(), left, right);
    for (const StereoKernel* kernel : StereoKernels()) {
      const Matched other = MatchRows(*kernel, left, right);
      const std::size_t bytes = plain.disparity_px.size() * sizeof(float);
      ASSERT_EQ(std::memcmp(plain.disparity_px.data(), other.disparity_px.data(), bytes), 0) << kernel->name;
      for (std::size_t u = 0; u < plain.disparity_px.size(); ++u) {
        ASSERT_TRUE(std::isnan(plain.disparity_px[u]) || plain.variance_px2[u] == other.variance_px2[u])
            << kernel->name;
      }
      ASSERT_EQ(plain.counts.no_partner, other.counts.no_partner);
      ASSERT_EQ(plain.counts.ambiguous, other.counts.ambiguous);
      ASSERT_EQ(plain.counts.left_right, other.counts.left_right);
    }
  }
}

}  // namespace
}  // namespace forgescan
