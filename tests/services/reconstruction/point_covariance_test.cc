#include "services/reconstruction/point_covariance.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <random>

namespace forgescan {
namespace {

// Disparity and ray shaken, points computed, against the formula.
TEST(PointCovariance, IsThatOfShakenPoints) {
  constexpr double kFocalPx = 3480, kPlainMm = 150, kPixelSigma = 0.05, kDisparitySigma = 0.03;
  const Eigen::Vector2d pixel(900, -500);
  constexpr double kDisparity = 1000;
  std::mt19937 random(3);
  std::normal_distribution<double> noise(0, 1);
  const auto point = [&](const Eigen::Vector2d& at, double disparity) -> Eigen::Vector3d {
    return kPlainMm / disparity * Eigen::Vector3d(at.x(), at.y(), kFocalPx);
  };
  const Eigen::Vector3d truth = point(pixel, kDisparity);
  Eigen::Matrix3d measured = Eigen::Matrix3d::Zero();
  constexpr int kCount = 100000;
  for (int i = 0; i < kCount; ++i) {
    const Eigen::Vector2d shaken = pixel + kPixelSigma * Eigen::Vector2d(noise(random), noise(random));
    const Eigen::Vector3d off = point(shaken, kDisparity + kDisparitySigma * noise(random)) - truth;
    measured += off * off.transpose() / kCount;
  }
  const Eigen::Matrix3d predicted =
      PointCovariance(truth, truth.norm() / kDisparity * kDisparitySigma, kPixelSigma, kFocalPx);
  // 100,000 samples know a variance to 0.45 %.
  EXPECT_LT((measured - predicted).norm(), 0.02 * predicted.norm());
}

TEST(PointCovariance, WithoutPixelNoiseIsFlat) {
  const Eigen::Vector3d p(30, -40, 500);
  const Eigen::Matrix3d covariance = PointCovariance(p, 0.02, 0, 3480);
  EXPECT_NEAR(covariance.trace(), 0.0004, 1e-12);
  EXPECT_NEAR((covariance * p.cross(Eigen::Vector3d::UnitX())).norm(), 0, 1e-9);
}

}  // namespace
}  // namespace forgescan
