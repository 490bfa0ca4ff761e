#include "services/common/features/ball_fit.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace forgescan {
namespace {

constexpr double kRadiusMm = 19.05;
const Eigen::Vector3d kCenter(30, -40, 650);

// What a camera at the origin sees of the ball, and a floor behind it.
PointCloud BallOnAFloor(double radius_mm, double noise_mm) {
  std::mt19937 random(3);
  std::normal_distribution<double> noise(0, noise_mm);
  std::uniform_real_distribution<double> floor(-60, 60);
  PointCloud cloud;
  for (int i = 0; i < 20'000; ++i) {
    const double z = 1 - 2 * (i + 0.5) / 20'000, around = 2.399963 * i, across = std::sqrt(1 - z * z);
    const Eigen::Vector3d out(across * std::cos(around), across * std::sin(around), z);
    if (out.dot(kCenter) < 0) {
      cloud.points.push_back((kCenter + (radius_mm + noise(random)) * out).cast<float>());
    }
  }
  for (int i = 0; i < 2'000; ++i) {
    cloud.points.push_back((kCenter + Eigen::Vector3d(floor(random), floor(random), 20)).cast<float>());
  }
  return cloud;
}

BallSearch Near(const Eigen::Vector3d& placed) { return {placed, Eigen::Vector3d::Zero(), kRadiusMm}; }

TEST(BallFit, FindsTheCentreOfAKnownBall) {
  const auto ball = FitBall(BallOnAFloor(kRadiusMm, 0.01), Near(kCenter + Eigen::Vector3d(4, -3, 2)));
  ASSERT_TRUE(ball.ok()) << ball.error().message;
  EXPECT_LT((ball->center - kCenter).norm(), 0.001);  // mm; 0.01 of a point over some 5000
  EXPECT_NEAR(ball->radius_mm, kRadiusMm, 0.005);
}

// A scan that is too small by 0.02 mm moves the centre along the view, not across it.
TEST(BallFit, ARadiusThatIsOffMovesTheCentreAlongTheView) {
  const auto ball = FitBall(BallOnAFloor(kRadiusMm - 0.02, 0), Near(kCenter));
  ASSERT_TRUE(ball.ok()) << ball.error().message;
  const Eigen::Vector3d moved = ball->center - kCenter, view = kCenter.normalized();
  EXPECT_NEAR(moved.dot(view), 0.0257, 0.001);  // 9 / 7 of it, over an even cap
  EXPECT_LT((moved - moved.dot(view) * view).norm(), 0.001);
  EXPECT_NEAR(ball->radius_mm, kRadiusMm - 0.02, 0.001);
}

TEST(BallFit, NoBallIsRefused) {
  const PointCloud cloud = BallOnAFloor(kRadiusMm, 0.01);
  EXPECT_FALSE(FitBall(cloud, Near(kCenter + Eigen::Vector3d(100, 0, 0))).ok());
  EXPECT_FALSE(FitBall({}, Near(kCenter)).ok());
  BallSearch huge = Near(kCenter);
  huge.radius_mm = 1e308;  // steps overflow
  const auto ball = FitBall(cloud, huge);
  ASSERT_FALSE(ball.ok());
  EXPECT_EQ(ball.error().code, ErrorCode::kDegenerate);
  EXPECT_TRUE(FitBall(cloud, Near(kCenter)).ok());
}

}  // namespace
}  // namespace forgescan
