// The sums of the fits against plain loops, and their bytes on every path.
#include "services/common/features/fit_sums.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <cstring>
#include <limits>
#include <random>

#include "services/common/features/robust_fit.h"

namespace forgescan {
namespace {

using Points = std::vector<Eigen::Vector3d>;

Points Scatter(std::size_t count) {
  std::mt19937_64 random(5);
  std::uniform_real_distribution<double> place(-40, 40);
  Points points;
  for (std::size_t i = 0; i < count; ++i) {
    const double x = place(random), y = place(random), z = place(random);
    points.emplace_back(800 + x, y, z - 100);
  }
  return points;
}

FitFrame Frame() {
  const Eigen::AngleAxisd turn(0.7, Eigen::Vector3d(1, 2, -1).normalized());
  return {Eigen::Vector3d(801, 2, -103), turn.toRotationMatrix()};
}

template <typename Shape>
void ExpectEqualBytes(const Shape& shape) {
  const Points points = Scatter(12'345);
  const auto sums = SumRows(points, Frame(), shape, 9, SimdPath::kPlain);
  const auto residuals = AbsoluteResiduals(points, Frame(), shape, SimdPath::kPlain);
  for (const SimdPath path : AvailableSimdPaths()) {
    const auto other = SumRows(points, Frame(), shape, 9, path);
    EXPECT_EQ(std::memcmp(&sums.normal, &other.normal, sizeof sums.normal), 0);
    EXPECT_EQ(std::memcmp(&sums.right, &other.right, sizeof sums.right), 0);
    EXPECT_EQ(sums.squares, other.squares);
    EXPECT_EQ(sums.along, other.along);
    EXPECT_EQ(sums.used, other.used);
    EXPECT_EQ(sums.lowest, other.lowest);
    EXPECT_EQ(sums.highest, other.highest);
    const auto again = AbsoluteResiduals(points, Frame(), shape, path);
    EXPECT_EQ(std::memcmp(residuals.data(), again.data(), residuals.size() * sizeof(float)), 0);
  }
}

TEST(FitSumsTest, Starts) { EXPECT_EQ(SumRows(Points{}, Frame(), SphereSums{3}, 1).used, 0U); }

TEST(FitSumsTest, SameBytesOnEveryPath) {
  ExpectEqualBytes(PlaneSums{0.05});
  ExpectEqualBytes(CylinderSums{30, 0.05});
  ExpectEqualBytes(ConeSums{30, std::cos(0.3), std::sin(0.3), 0.05});
  ExpectEqualBytes(SphereSums{35});
}

TEST(FitSumsTest, AreThoseOfAPlainLoop) {
  const Points points = Scatter(2'001);
  const FitFrame frame = Frame();
  const auto sums = SumRows(points, frame, CylinderSums{30, 0.05}, 6);
  Eigen::Matrix<double, 5, 5> normal = Eigen::Matrix<double, 5, 5>::Zero();
  Eigen::Matrix<double, 5, 1> right = Eigen::Matrix<double, 5, 1>::Zero();
  double squares = 0, along = 0;
  std::size_t used = 0;
  for (const Eigen::Vector3d& p : points) {
    const Eigen::Vector3d q = frame.axes.transpose() * (p - frame.origin);
    const double distance = q.head<2>().norm(), residual = distance - 30;
    if (std::abs(residual) > 6) continue;
    Eigen::Matrix<double, 5, 1> row;
    row << q.head<2>() / distance, 0.05 * q.z() * q.head<2>() / distance, 1;
    normal += row * row.transpose();
    right += row * residual;
    squares += residual * residual;
    along += q.z();
    ++used;
  }
  EXPECT_EQ(sums.used, used);
  EXPECT_EQ(sums.finite, points.size());
  // Rounding of a sum of 2000 numbers.
  EXPECT_LT((sums.normal - normal).norm(), 1e-12 * normal.norm());
  EXPECT_LT((sums.right - right).norm(), 1e-9);
  EXPECT_NEAR(sums.squares, squares, 1e-9);
  EXPECT_NEAR(sums.along, along, 1e-8);
}

// A row is minus the derivative of the residual: the sums' step, taken by the shape, does what it says.
TEST(FitSumsTest, RowsOfTheConeAreDerivatives) {
  const Points one{Eigen::Vector3d(20, 13, 8)};
  const double angle = 0.4, radius = 21, kStep = 1e-6, per_mm = 0.1;
  const auto residual = [&](const Eigen::Vector3d& origin, const Eigen::Vector2d& tilt, double r, double a) {
    const Eigen::Vector3d w = Eigen::Vector3d(tilt.x(), tilt.y(), 1).normalized();
    const Eigen::Vector3d q = one[0] - origin;
    return ((q - q.dot(w) * w).norm() - r) * std::cos(a) - q.dot(w) * std::sin(a);
  };
  const auto sums = SumRows(one, FitFrame{}, ConeSums{radius, std::cos(angle), std::sin(angle), per_mm}, 1e3);
  const double at = residual({0, 0, 0}, {0, 0}, radius, angle);
  const double moved[] = {residual({kStep, 0, 0}, {0, 0}, radius, angle),
                          residual({0, kStep, 0}, {0, 0}, radius, angle),
                          residual({0, 0, 0}, {kStep * per_mm, 0}, radius, angle),
                          residual({0, 0, 0}, {0, kStep * per_mm}, radius, angle),
                          residual({0, 0, 0}, {0, 0}, radius + kStep, angle),
                          residual({0, 0, 0}, {0, 0}, radius, angle + kStep * per_mm)};
  EXPECT_NEAR(std::sqrt(sums.squares), std::abs(at), 1e-12);
  for (int i = 0; i < 6; ++i) {
    // 1e-5: the second derivative over a step of 1e-6 and its rounding.
    EXPECT_NEAR(sums.right[i] / at, -(moved[i] - at) / kStep, 1e-5) << i;
  }
}

TEST(FitSumsTest, WhatIsNotFiniteIsNotUsedAndNotCounted) {
  Points points = Scatter(100);
  const std::size_t before = SumRows(points, Frame(), SphereSums{35}, 1e3).used;
  points[17].x() = std::numeric_limits<double>::quiet_NaN();
  points[99].z() = std::numeric_limits<double>::infinity();
  const auto sums = SumRows(points, Frame(), SphereSums{35}, 1e3);
  EXPECT_EQ(before, 100U);
  EXPECT_EQ(sums.used, 98U);
  EXPECT_EQ(sums.finite, 98U);
  EXPECT_TRUE(sums.normal.allFinite());
}

TEST(RobustFitTest, TheLimitIsThatOfTheMiddleResidual) {
  std::vector<float> residuals;
  for (int i = 0; i < 1001; ++i) residuals.push_back(static_cast<float>((i * 7919) % 1001));
  EXPECT_NEAR(RejectionLimit(residuals, 3), 3 * 1.4826 * 500, 1e-4);
  EXPECT_LT(RejectionLimit({}, 3), 1e-5);
  // Those that are no number are the farthest.
  for (int i = 0; i < 400; ++i) residuals[static_cast<std::size_t>(i)] = std::nanf("");
  EXPECT_GT(RejectionLimit(residuals, 3), 3 * 1.4826 * 500);
}

TEST(RobustFitTest, AnEvenSampleKeepsOrderAndTakesFromEveryStretch) {
  Points line;
  for (int i = 0; i < 10'000; ++i) line.emplace_back(i, 0, 0);
  EXPECT_EQ(EvenSample(line, 20'000).size(), line.size());
  const auto sample = EvenSample(line, 1000);
  ASSERT_EQ(sample.size(), 1000U);
  for (std::size_t i = 0; i < sample.size(); ++i) {
    EXPECT_EQ(std::floor(sample[i].x() / 10), static_cast<double>(i));
  }
}

TEST(RobustFitTest, TheThinnestShellHolds95Percent) {
  std::vector<double> residuals;
  for (int i = 0; i < 95; ++i) residuals.push_back(0.01 * i);
  for (int i = 0; i < 5; ++i) residuals.push_back(7);
  EXPECT_NEAR(ThinnestShellMm(residuals), 0.94, 1e-12);
  EXPECT_EQ(ThinnestShellMm({3}), 0);
}

}  // namespace
}  // namespace forgescan
