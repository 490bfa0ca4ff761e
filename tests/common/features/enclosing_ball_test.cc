#include "services/common/features/enclosing_ball.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <limits>
#include <numbers>
#include <random>
#include <vector>

namespace forgescan {
namespace {

using Points = std::vector<Eigen::Vector3d>;

constexpr double kRounding = 1e-12;  // of lengths about 1, a few operations

Eigen::Vector3d RandomUnit(std::mt19937_64& random) {
  std::normal_distribution<double> normal;
  const double x = normal(random), y = normal(random), z = normal(random);
  return Eigen::Vector3d(x, y, z).normalized();
}

TEST(EnclosingBallTest, Starts) { EXPECT_TRUE(MinimumEnclosingBall(Points{{1, 2, 3}}).ok()); }

TEST(EnclosingBallTest, OneTwoAndFourPoints) {
  const auto one = MinimumEnclosingBall(Points{{1, 2, 3}});
  EXPECT_EQ(one->radius, 0);
  EXPECT_EQ(one->center, Eigen::Vector3d(1, 2, 3));
  const auto two = MinimumEnclosingBall(Points{{0, 0, 0}, {2, 0, 0}});
  EXPECT_NEAR(two->radius, 1, kRounding);
  EXPECT_LT((two->center - Eigen::Vector3d(1, 0, 0)).norm(), kRounding);
  // A regular tetrahedron with edge 2 sqrt 2 about the origin: radius sqrt 3.
  const auto four = MinimumEnclosingBall(Points{{1, 1, 1}, {1, -1, -1}, {-1, 1, -1}, {-1, -1, 1}});
  EXPECT_NEAR(four->radius, std::sqrt(3.0), kRounding);
  EXPECT_LT(four->center.norm(), kRounding);
}

// The third point lies inside the ball of the first two, or decides it, by its height.
TEST(EnclosingBallTest, AnObtuseTriangleIsHeldByItsLongSide) {
  const auto flat = MinimumEnclosingBall(Points{{-1, 0, 0}, {1, 0, 0}, {0, 0.5, 0}});
  EXPECT_NEAR(flat->radius, 1, kRounding);
  const auto high = MinimumEnclosingBall(Points{{-1, 0, 0}, {1, 0, 0}, {0, 2, 0}});
  EXPECT_NEAR(high->radius, 1.25, kRounding);  // circumscribed circle: (1 + 4) / (2 * 2)
}

TEST(EnclosingBallTest, EqualPointsPointsOnALineAndOnACircle) {
  EXPECT_EQ(MinimumEnclosingBall(Points(7, Eigen::Vector3d(4, 5, 6)))->radius, 0);
  Points line, circle;
  for (int i = 0; i <= 20; ++i) line.emplace_back(i, 2 * i, -i);
  EXPECT_NEAR(MinimumEnclosingBall(line)->radius, 10 * std::sqrt(6.0), 1e-10);
  for (int i = 0; i < 36; ++i) circle.emplace_back(3 * std::cos(i * 0.1745), 3 * std::sin(i * 0.1745), 1);
  const auto ball = MinimumEnclosingBall(circle);
  EXPECT_NEAR(ball->radius, 3, 1e-9);
  EXPECT_LT((ball->center - Eigen::Vector3d(0, 0, 1)).norm(), 1e-4);  // flat minimum: square root of rounding
}

// Minimal: no ball with a centre moved a little to any side holds the points with a smaller radius.
TEST(EnclosingBallTest, HoldsAllPointsAndIsTheSmallest) {
  std::mt19937_64 random(3);
  std::normal_distribution<double> normal;
  for (int trial = 0; trial < 200; ++trial) {
    Points points;
    for (int i = 0; i < 2 + trial % 30; ++i) {
      const double x = normal(random), y = normal(random), z = normal(random);
      points.emplace_back(1000 + 0.01 * x, -500 + 0.01 * y, 80 + 0.01 * z);
    }
    const auto ball = MinimumEnclosingBall(points);
    ASSERT_TRUE(ball.ok());
    const auto reach = [&](const Eigen::Vector3d& center) {
      double farthest = 0;
      for (const auto& p : points) farthest = std::max(farthest, (p - center).norm());
      return farthest;
    };
    EXPECT_LE(reach(ball->center), ball->radius + 1e-12);  // mm: rounding of coordinates about 1000
    for (int i = 0; i < 30; ++i) {
      EXPECT_GT(reach(ball->center + 1e-4 * RandomUnit(random)), ball->radius);
    }
  }
}

TEST(EnclosingBallTest, RefusesNothingAndWhatIsNotFiniteAndWorksAgain) {
  EXPECT_EQ(MinimumEnclosingBall({}).error().code, ErrorCode::kInvalidArgument);
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(MinimumEnclosingBall(Points{{0, 0, 0}, {0, nan, 0}}).error().code, ErrorCode::kInvalidArgument);
  EXPECT_TRUE(MinimumEnclosingBall(Points{{0, 0, 0}}).ok());
}

TEST(MinimumConeTest, KeepsItsDigitsAtSmallAngles) {
  const Eigen::Vector3d axis = Eigen::Vector3d(0.6, -0.2, 0.7).normalized();
  const Eigen::Vector3d u = axis.unitOrthogonal(), v = axis.cross(u);
  for (const double half_rad : {1e-7, 7.75e-5, 0.01, 0.7, 1.3}) {
    Points directions{3 * axis};  // the length does not count
    for (const double turn : {0.3, 2.5, 4.4}) {
      directions.push_back(std::cos(half_rad) * axis +
                           std::sin(half_rad) * (std::cos(turn) * u + std::sin(turn) * v));
    }
    const auto cone = MinimumCone(directions);
    ASSERT_TRUE(cone.ok()) << half_rad << ": " << cone.error().message;
    // Unit vectors are rounded by 1e-16; three times that, and a few digits of the angle for its computation.
    EXPECT_NEAR(cone->half_angle_rad, half_rad, 3e-16 + 1e-12 * half_rad) << half_rad;
    EXPECT_LT(cone->axis.cross(axis).norm(), 1e-15 + 1e-9 * half_rad);
    EXPECT_EQ(cone->FullAngleRad(), 2 * cone->half_angle_rad);
  }
}

// sin(half angle) is the radius of the ball about the unit vectors.
TEST(MinimumConeTest, AgreesWithTheBallAboutTheUnitVectors) {
  std::mt19937_64 random(5);
  for (int trial = 0; trial < 100; ++trial) {
    const Eigen::Vector3d axis = RandomUnit(random);
    Points units;
    for (int i = 0; i < 2 + trial % 9; ++i) units.push_back((axis + 0.3 * RandomUnit(random)).normalized());
    const auto cone = MinimumCone(units);
    const auto ball = MinimumEnclosingBall(units);
    ASSERT_TRUE(cone.ok());
    EXPECT_NEAR(std::sin(cone->half_angle_rad), ball->radius, 1e-9);
  }
}

TEST(MinimumConeTest, RefusesWhatHasNoCone) {
  EXPECT_EQ(MinimumCone({}).error().code, ErrorCode::kInvalidArgument);
  EXPECT_EQ(MinimumCone(Points{{0, 0, 0}}).error().code, ErrorCode::kInvalidArgument);
  EXPECT_EQ(MinimumCone(Points{{1, 0, 0}, {-1, 0, 0}}).error().code, ErrorCode::kDegenerate);
  const Points axes{{1, 0, 0}, {0, 1, 0}, {-1, -0.1, 0}};
  EXPECT_EQ(MinimumCone(axes).error().code, ErrorCode::kDegenerate);
  EXPECT_TRUE(MinimumCone(Points{{1, 0, 0}}).ok());
}

}  // namespace
}  // namespace forgescan
