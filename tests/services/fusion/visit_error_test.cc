#include "services/fusion/visit_error.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>

#include "tests/services/fusion/standing_scene.h"

namespace forgescan {
namespace {

using testing::AddSquare;
using testing::Corner;
using ::testing::HasSubstr;
using testing::kMiddle;
using testing::Motion;
using testing::Moved;
using testing::Plane;
using testing::Robot;

Result<VisitError> Estimate(const PointCloud& standing, const PointCloud& now) {
  const VisitErrorOptions options = Robot();
  return EstimateVisitError(SurfaceCells(standing, options.cells), now, options);
}

TEST(VisitError, IsFoundWhereAllMotionsAreSeen) {
  const Eigen::Isometry3d taught_from_actual = Motion({0.008, -0.005, 0.006}, {3e-5, -2e-5, 4e-5});
  const auto error = Estimate(Corner(1), Moved(Corner(2), taught_from_actual.inverse()));
  ASSERT_TRUE(error.ok()) << error.error().message;
  EXPECT_GT(error->cells, 3000U);
  const double shift_mm = error->standard.head<3>().maxCoeff(),
               turn_rad = error->standard.tail<3>().maxCoeff();
  EXPECT_LT(shift_mm, 0.001);  // a fifth of the robot's
  EXPECT_LT(turn_rad, 0.00001);
  for (const Eigen::Vector3d& p : {kMiddle, Eigen::Vector3d(150, 100, 630), Eigen::Vector3d(-150, 0, 670)}) {
    // Four of its own standard deviations; 50 mm: from the middle of what is seen to kMiddle, at most.
    EXPECT_LT((error->taught_from_actual * p - taught_from_actual * p).norm(),
              4 * (shift_mm + turn_rad * ((p - kMiddle).norm() + 50)));
  }
}

TEST(VisitError, WhatNothingShowsStaysZero) {
  const auto error = Estimate(Plane(1), Moved(Plane(2), Motion({0.01, 0.01, 0.01}, {0, 0, 0}).inverse()));
  ASSERT_TRUE(error.ok()) << error.error().message;
  const Eigen::Vector3d shift = error->taught_from_actual * kMiddle - kMiddle;
  EXPECT_NEAR(shift.x(), 0, 1e-5);  // mm
  EXPECT_NEAR(shift.y(), 0, 1e-5);
  EXPECT_NEAR(shift.z(), 0.01, 0.0006);  // mm, 4 standard deviations
  EXPECT_NEAR(error->standard[0], 0.005, 1e-5);
  EXPECT_LT(error->standard[2], 0.0005);
}

TEST(SurfaceCells, APointWithoutADirectionIsInNoCell) {
  constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
  for (const Eigen::Vector3d& p :
       {Eigen::Vector3d(kNan, 0, 1), Eigen::Vector3d(0, 0, kNan), Eigen::Vector3d(1, 1, 0),
        Eigen::Vector3d(1, 1, -5), Eigen::Vector3d(1e30, 0, 1)}) {
    EXPECT_FALSE(DirectionKey(p, 0.003).has_value()) << p.transpose();
  }
  EXPECT_TRUE(DirectionKey({-100, 100, 650}, 0.003).has_value());
  PointCloud cloud = Plane(1);
  const std::size_t cells = SurfaceCells(cloud, {}).size();
  for (int i = 0; i < 20; ++i) {
    cloud.points.emplace_back(i % 2 == 0 ? std::nanf("") : 1.F, 1.F, i % 2 == 0 ? 650.F : -650.F);
    cloud.normals.emplace_back(0.F, 0.F, -1.F);
    cloud.sigma_mm.push_back(0.02F);
  }
  EXPECT_EQ(SurfaceCells(cloud, {}).size(), cells);
  EXPECT_TRUE(SurfaceCells({}, {}).empty());
}

TEST(SurfaceCells, HaveAscendingKeysWhereverTheyLie) {
  PointCloud cloud;
  for (const double right : {-900.0, 300.0, 0.0, -20.0}) {
    for (const double down : {500.0, -700.0, 1.0}) {
      for (int i = 0; i < 6; ++i) {
        cloud.points.emplace_back(static_cast<float>(right + 0.1 * i), static_cast<float>(down), 650.F);
        cloud.normals.emplace_back(0.F, 0.F, -1.F);
        cloud.sigma_mm.push_back(0.02F);
      }
    }
  }
  const auto cells = SurfaceCells(cloud, {});
  ASSERT_EQ(cells.size(), 12U);
  for (std::size_t i = 1; i < cells.size(); ++i) EXPECT_LT(cells[i - 1].key, cells[i].key);
}

TEST(VisitError, ALoneViewIsLeftAlone) {
  const auto error = Estimate({}, Corner(1));
  ASSERT_TRUE(error.ok());
  EXPECT_EQ(error->cells, 0U);
  EXPECT_TRUE(error->taught_from_actual.isApprox(Eigen::Isometry3d::Identity(), 1e-12));
}

TEST(VisitError, ThePartDoesNotCount) {
  PointCloud now = Corner(2);
  std::mt19937 random(3);
  AddSquare(kMiddle + Eigen::Vector3d(0, 80, -0.4), Eigen::Vector3d(0, 0, -1), random, now);  // on a rest
  AddSquare(kMiddle - Eigen::Vector3d(0, 0, 60), Eigen::Vector3d(0, 0, -1), random, now);
  const auto error = Estimate(Corner(1), now);
  ASSERT_TRUE(error.ok()) << error.error().message;
  EXPECT_LT((error->taught_from_actual * kMiddle - kMiddle).norm(),
            0.003);  // mm: a third of the places is lost
}

TEST(VisitError, CellsWithoutAVarianceDoNotCount) {
  const VisitErrorOptions options = Robot();
  const auto standing = SurfaceCells(Corner(1), options.cells);
  const PointCloud now = Corner(2);
  const auto whole = EstimateVisitError(standing, now, options);
  ASSERT_TRUE(whole.ok()) << whole.error().message;
  for (const double sigma_mm : {std::nan(""), HUGE_VAL}) {
    PointCloud with_one = now;  // a point in the middle of the first square
    with_one.sigma_mm[now.size() / 6] = static_cast<float>(sigma_mm);
    const auto error = EstimateVisitError(standing, with_one, options);
    ASSERT_TRUE(error.ok()) << error.error().message;
    EXPECT_EQ(error->cells, whole->cells - 1);
    // mm: one cell of thousands
    EXPECT_LT((error->taught_from_actual * kMiddle - whole->taught_from_actual * kMiddle).norm(), 1e-5);
    EXPECT_TRUE(error->standard.allFinite());
  }
  PointCloud exact = now;
  std::fill(exact.sigma_mm.begin(), exact.sigma_mm.end(), 0.0F);
  const auto none = EstimateVisitError(standing, exact, options);
  ASSERT_TRUE(none.ok()) << none.error().message;
  EXPECT_EQ(none->cells, 0U);
  EXPECT_TRUE(none->taught_from_actual.isApprox(Eigen::Isometry3d::Identity(), 1e-12));
}

TEST(VisitError, AnErrorThatIsNoNumberIsRefused) {
  const VisitErrorOptions options = Robot();
  auto standing = SurfaceCells(Corner(1), options.cells);
  for (SurfaceCell& cell : standing) cell.point.z() = std::nan("");
  const auto error = EstimateVisitError(standing, Corner(2), options);
  ASSERT_FALSE(error.ok());
  EXPECT_EQ(error.error().code, ErrorCode::kUntrusted);
}

// A square of its own beside the corner's three.
PointCloud CornerAndSquare(unsigned seed, double moved_mm) {
  PointCloud cloud = Corner(seed);
  std::mt19937 random(seed + 100);
  AddSquare(kMiddle + Eigen::Vector3d(-110, -80, moved_mm), Eigen::Vector3d(0, 0, -1), random, cloud);
  return cloud;
}

TEST(VisitError, APieceThatMovedByItselfIsNamed) {
  EXPECT_TRUE(Estimate(CornerAndSquare(1, 0), CornerAndSquare(2, 0.002)).ok());  // mm: it would not matter
  const auto error = Estimate(CornerAndSquare(1, 0), CornerAndSquare(2, 0.03));
  ASSERT_FALSE(error.ok());
  EXPECT_EQ(error.error().code, ErrorCode::kUntrusted);
  EXPECT_THAT(error.error().message, HasSubstr("a piece of what stood still lies"));
}

TEST(VisitError, OfFewPlacesNothingIsSaid) {
  std::mt19937 random(1);
  PointCloud standing, now;
  AddSquare(kMiddle, Eigen::Vector3d(0, 0, -1), random, standing);
  AddSquare(kMiddle - Eigen::Vector3d(0, 0, 2), Eigen::Vector3d(0, 0, -1), random, now);  // before all of it
  VisitErrorOptions options = Robot();
  const auto cells = SurfaceCells(standing, options.cells);
  EXPECT_FALSE(EstimateVisitError(cells, now, options).ok());
  options.min_cells = cells.size() + 1;
  const auto error = EstimateVisitError(cells, now, options);
  ASSERT_TRUE(error.ok()) << error.error().message;
  EXPECT_EQ(error->cells, 0U);
  EXPECT_EQ(error->standard[0], options.robot_shift_mm);
  EXPECT_TRUE(error->taught_from_actual.isApprox(Eigen::Isometry3d::Identity(), 1e-12));
}

TEST(VisitError, APointThatIsNoPlaceChangesNothing) {
  PointCloud now = Corner(2);
  const auto without = Estimate(Corner(1), now);
  now.points.emplace_back(std::nanf(""), 0.F, 650.F);
  now.normals.emplace_back(0.F, 0.F, -1.F);
  now.sigma_mm.push_back(0.02F);
  const auto with = Estimate(Corner(1), now);
  ASSERT_TRUE(without.ok() && with.ok());
  EXPECT_TRUE(with->taught_from_actual.isApprox(without->taught_from_actual, 0));
}

TEST(VisitError, AKnockIsNotCorrected) {
  for (const double shift_mm : {0.08, 0.4}) {
    const auto error = Estimate(Corner(1), Moved(Corner(2), Motion({0, 0, shift_mm}, {0, 0, 0})));
    ASSERT_FALSE(error.ok()) << shift_mm;
    EXPECT_THAT(error.error().message, HasSubstr("a knock"));
  }
}

}  // namespace
}  // namespace forgescan
