#include "services/fusion/standing_surfaces.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "services/fusion/visit_correction.h"
#include "tests/services/fusion/standing_scene.h"

namespace forgescan {
namespace {

using testing::AddSquare;
using testing::AtLeast;
using testing::Corner;
using ::testing::HasSubstr;
using testing::kMiddle;
using testing::Motion;
using testing::Moved;
using testing::Robot;

const Eigen::AlignedBox3d kEverywhere(Eigen::Vector3d::Constant(-5000), Eigen::Vector3d::Constant(5000));

ViewMatrices TwoViews() {
  ViewMatrices matrices;
  matrices.array_from_camera.assign(2, Eigen::Isometry3d(Eigen::Translation3d(0, 0, -650)));
  return matrices;
}

std::vector<ViewCloud> ScanOf(const PointCloud& cloud, int view = 1) {
  return {{view, std::nan(""), cloud, {}}};
}

TEST(StandingSurfaces, WhatMovesOutsideTheRegionsIsNoKnock) {
  const ViewMatrices matrices = TwoViews();
  const Eigen::AlignedBox3d region(Eigen::Vector3d(-150, -150, -60), Eigen::Vector3d(150, 150, 60));
  const auto with_belt = [](unsigned seed, double belt_mm) {
    PointCloud cloud = Corner(seed);
    std::mt19937 random(seed + 100);
    for (const double x : {-240.0, 240.0}) {
      AddSquare(kMiddle + Eigen::Vector3d(x, 0, 200 + belt_mm), Eigen::Vector3d(0, 0, -1), random, cloud);
    }
    return cloud;
  };
  for (const double belt_mm : {0.05, 0.3}) {
    const std::vector<std::vector<ViewCloud>> scans{ScanOf(with_belt(1, 0)), ScanOf(with_belt(2, belt_mm))};
    const auto standing = MakeStandingSurfaces(scans, {{}, matrices, {&region, 1}, Robot()});
    EXPECT_TRUE(standing.ok()) << standing.error().message;
  }
}

TEST(StandingSurfaces, OnlyWhatLiesInARegionCounts) {
  const ViewMatrices matrices = TwoViews();
  // The second square of the corner.
  const Eigen::AlignedBox3d region(Eigen::Vector3d(40, -60, -60), Eigen::Vector3d(150, 60, 60));
  const std::vector<std::vector<ViewCloud>> scans{ScanOf(Corner(1))};
  const auto all = MakeStandingSurfaces(scans, {{}, matrices, {&kEverywhere, 1}, Robot()});
  const auto some = MakeStandingSurfaces(scans, {{}, matrices, {&region, 1}, Robot()});
  ASSERT_TRUE(all.ok() && some.ok());
  EXPECT_TRUE(all->views.at(0).empty());
  EXPECT_GT(some->views.at(1).size(), 300U);
  EXPECT_LT(some->views.at(1).size(), all->views.at(1).size());
  for (const SurfaceCell& cell : some->views[1]) {
    EXPECT_TRUE(region.contains(matrices.array_from_camera[1] * cell.point));
  }
}

// One scan hands its visit's error to the reference; the mean of several does not.
TEST(StandingSurfaces, SeveralScansAreAveraged) {
  const ViewMatrices matrices = TwoViews();
  std::vector<Eigen::Isometry3d> visits;  // taught from actual; their mean is none
  for (const double sign : {1.0, -1.0}) {
    visits.push_back(
        Motion(sign * Eigen::Vector3d(0.01, -0.008, 0.006), sign * Eigen::Vector3d(3e-5, 2e-5, -4e-5)));
  }
  std::vector<std::vector<ViewCloud>> scans;
  for (unsigned i = 0; i < 2; ++i) scans.push_back(ScanOf(Moved(Corner(10 + i), visits[i].inverse())));
  const auto error_at_middle_mm = [&](std::span<const std::vector<ViewCloud>> of) {
    const auto standing = MakeStandingSurfaces(of, {{}, matrices, {&kEverywhere, 1}, Robot()});
    EXPECT_EQ(standing->scans, static_cast<int>(of.size()));
    const auto error = EstimateVisitError(standing->views[1], Corner(3), Robot());
    return (error->taught_from_actual * kMiddle - kMiddle).norm();
  };
  EXPECT_GT(error_at_middle_mm({scans.data(), 1}), 0.01);  // of the 0.014 mm of that visit
  EXPECT_LT(error_at_middle_mm(scans), 0.002);             // mm: noise
}

TEST(StandingSurfaces, RefusesWhatCannotBeAReference) {
  const ViewMatrices matrices = TwoViews();
  const std::vector<std::vector<ViewCloud>> one{ScanOf(Corner(1))}, unknown{ScanOf(Corner(1), 2)};
  const std::vector<std::vector<ViewCloud>> knocked{
      ScanOf(Corner(1)), ScanOf(Moved(Corner(2), Motion({0.08, 0, 0}, {0, 0, 0})))};
  const Eigen::AlignedBox3d nowhere(Eigen::Vector3d(1000, 0, 0), Eigen::Vector3d(1001, 1, 1));
  const StandingRequest request{{}, matrices, {&kEverywhere, 1}, Robot()};
  EXPECT_THAT(MakeStandingSurfaces({}, request).error().message,
              HasSubstr("at least one scan and one region"));
  EXPECT_THAT(MakeStandingSurfaces(one, {{}, matrices, {}, {}}).error().message,
              HasSubstr("there are 1 and 0"));
  EXPECT_THAT(MakeStandingSurfaces(unknown, request).error().message,
              HasSubstr("view 2 has no view matrix; there are matrices 0 to 1"));
  const auto moved = MakeStandingSurfaces(knocked, request);
  ASSERT_FALSE(moved.ok());
  EXPECT_EQ(moved.error().code, ErrorCode::kUntrusted);
  EXPECT_THAT(moved.error().message, HasSubstr("view 1: scan 2 against the first: "));
  EXPECT_THAT(MakeStandingSurfaces(one, {{}, matrices, {&nowhere, 1}, Robot()}).error().message,
              HasSubstr("no surface in any of the 1 regions"));
}

TEST(VisitCorrection, ReplacesTheRobotsErrorWhereEnoughIsSeen) {
  const ViewMatrices matrices = TwoViews();
  const std::vector<std::vector<ViewCloud>> scans{ScanOf(Corner(1))};
  const auto standing = MakeStandingSurfaces(scans, {{}, matrices, {&kEverywhere, 1}, Robot()});
  ASSERT_TRUE(standing.ok()) << standing.error().message;
  const VisitCorrection correction(*standing, AtLeast(100));
  const PointCloud now = Moved(Corner(2), Motion({0.008, 0, 0}, {0, 0, 0}).inverse());
  const auto seen = correction.Of(1, now);
  ASSERT_TRUE(seen.ok()) << seen.error().message;
  EXPECT_TRUE(seen->corrected);
  EXPECT_NEAR(seen->shift_um, 8, 2);  // four standard deviations of the noise
  EXPECT_THAT(seen->text, HasSubstr("corrected by "));
  for (const int view : {0, 7, -1}) {  // nothing stands still there
    const auto blind = correction.Of(view, now);
    ASSERT_TRUE(blind.ok()) << blind.error().message;
    EXPECT_FALSE(blind->corrected);
    EXPECT_TRUE(blind->taught_from_actual.isApprox(Eigen::Isometry3d::Identity(), 0));
    EXPECT_THAT(blind->text, HasSubstr("only 0 cells of what stands still seen, at least 100"));
  }
  const VisitCorrection strict(*standing, AtLeast(100'000));
  EXPECT_FALSE(strict.Of(1, now)->corrected);
  EXPECT_FALSE(correction.Of(1, Moved(Corner(2), Motion({0.08, 0, 0}, {0, 0, 0}))).ok());
}

// 0.005 mm of the robot and as much of the one scan of the reference: a knock is more than 6 x 0.0071 mm.
TEST(VisitCorrection, TheReferenceHasAnErrorToo) {
  EXPECT_NEAR(AgainstMeanOf(1, Robot()).robot_shift_mm, 0.00707, 1e-5);
  EXPECT_NEAR(AgainstMeanOf(4, Robot()).robot_turn_rad / Robot().robot_turn_rad, 1.118, 1e-3);
  const ViewMatrices matrices = TwoViews();
  const std::vector<std::vector<ViewCloud>> scans{ScanOf(Corner(1))};
  const auto standing = MakeStandingSurfaces(scans, {{}, matrices, {&kEverywhere, 1}, Robot()});
  ASSERT_TRUE(standing.ok()) << standing.error().message;
  const VisitCorrection correction(*standing, AtLeast(100));
  EXPECT_TRUE(correction.Of(1, Moved(Corner(2), Motion({0.036, 0, 0}, {0, 0, 0}).inverse())).ok());
  EXPECT_FALSE(correction.Of(1, Moved(Corner(2), Motion({0.050, 0, 0}, {0, 0, 0}).inverse())).ok());
}

TEST(VisitCorrection, AsksForWhatTheRobotScatters) {
  EXPECT_THAT(VisitOptionsOf(FusionConfig()).error().message, HasSubstr("robot_shift_mm and robot_turn_rad"));
  FusionConfig config;
  config.robot_shift_mm = 0.02;
  config.robot_turn_rad = 1e-4;
  config.max_robot_sigmas = 4;
  const auto options = VisitOptionsOf(config);
  ASSERT_TRUE(options.ok());
  EXPECT_EQ(options->robot_shift_mm, 0.02);
  EXPECT_EQ(options->max_sigmas, 4);
}

}  // namespace
}  // namespace forgescan
