#include "services/reconstruction/row_matcher.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

namespace forgescan {
namespace {

constexpr float kNan = std::numeric_limits<float>::quiet_NaN();

std::vector<float> Ramp(int count, float first, float step) {
  std::vector<float> row;
  for (int i = 0; i < count; ++i) {
    row.push_back(first + step * static_cast<float>(i));
  }
  return row;
}

CoordinateRow Row(const std::vector<float>& values, float slope) { return {values, 0.3F * slope, 3 * slope}; }

TEST(RowMatcher, FindsSubPixelPartnersInBothDirectionsOfTheFringes) {
  for (const float sign : {1.0F, -1.0F}) {
    const auto left = Ramp(50, 100 + sign * 3, sign * 0.8F);
    const auto right = Ramp(50, 100, sign * 1.2F);
    RowMatcher matcher(200);
    const auto& match = matcher.Match(Row(left, sign * 0.8F), Row(right, sign * 1.2F), 0.2F);
    for (std::size_t u = 1; u + 1 < left.size(); ++u) {
      ASSERT_EQ(match.outcome[u], MatchOutcome::kMatched) << u;
      ASSERT_NEAR(match.partner_px[u], (3 + 0.8F * static_cast<float>(u)) / 1.2F, 1e-4) << u;  // px, float
    }
  }
}

TEST(RowMatcher, DropsWhatFitsTwice) {
  const auto left = Ramp(20, 10, 1);
  auto right = Ramp(20, 10, 1);
  const auto again = Ramp(6, 14.2F, 1);  // the columns 14.2 .. 19.2 a second time
  right.push_back(kNan);
  right.insert(right.end(), again.begin(), again.end());
  RowMatcher matcher(64);
  const auto& match = matcher.Match(Row(left, 1), Row(right, 1), 0.2F);
  EXPECT_EQ(match.outcome[2], MatchOutcome::kMatched);
  EXPECT_EQ(match.outcome[6], MatchOutcome::kAmbiguous);
  EXPECT_EQ(match.outcome[12], MatchOutcome::kMatched);
}

TEST(RowMatcher, NeverBridgesAGapOrAJump) {
  const auto left = Ramp(20, 10, 1);
  auto right = Ramp(20, 10.5F, 1);
  right[5] = kNan;  // 15.5
  right[12] += 20;  // a wrong fringe order
  RowMatcher matcher(64);
  const auto& match = matcher.Match(Row(left, 1), Row(right, 1), 0.2F);
  EXPECT_EQ(match.outcome[5], MatchOutcome::kNoPartner);   // 15 lies between 14.5 and the gap
  EXPECT_EQ(match.outcome[12], MatchOutcome::kNoPartner);  // 22 lies before the jump
  EXPECT_EQ(match.outcome[9], MatchOutcome::kMatched);
}

TEST(RowMatcher, StandsCoordinatesFarOutside) {
  RowMatcher matcher(10);
  const std::vector<float> wild = {-1e9F, 1e9F, kNan, 5};
  const auto& match = matcher.Match(Row(wild, 1), Row(wild, 1), 0.2F);
  EXPECT_EQ(match.outcome[2], MatchOutcome::kNone);
  EXPECT_EQ(match.outcome[0], MatchOutcome::kNoPartner);
}

}  // namespace
}  // namespace forgescan
