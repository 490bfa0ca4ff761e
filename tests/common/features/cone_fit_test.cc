#include "services/common/features/cone_fit.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <limits>
#include <numbers>
#include <random>

#include "services/common/features/cylinder_fit.h"

namespace forgescan {
namespace {

using Points = std::vector<Eigen::Vector3d>;

const Eigen::Vector3d kAxis = Eigen::Vector3d(0.9, -0.3, 0.2).normalized();
const Eigen::Vector3d kCenter(812, -40, 33);
constexpr double kRadius = 30, kHalfAngle = 0.12, kNoiseMm = 0.02;

// 60 mm long about kCenter, one in ten points 0.5 to 5 mm outside.
Points Cone(std::size_t count, double half_angle, double arc_deg, double half_length = 30) {
  std::mt19937_64 random(3);
  std::uniform_real_distribution<double> share(0, 1);
  std::normal_distribution<double> noise(0, kNoiseMm);
  const Eigen::Vector3d u = kAxis.unitOrthogonal(), v = kAxis.cross(u);
  Points points;
  for (std::size_t i = 0; i < count; ++i) {
    const double along = half_length * (2 * share(random) - 1);
    const double turn = arc_deg * share(random) * std::numbers::pi / 180;
    const double off = share(random) < 0.1 ? 0.5 + 4.5 * share(random) : noise(random);
    const Eigen::Vector3d out = std::cos(turn) * u + std::sin(turn) * v;
    const Eigen::Vector3d normal = std::cos(half_angle) * out - std::sin(half_angle) * kAxis;
    points.push_back(kCenter + along * kAxis + (kRadius + along * std::tan(half_angle)) * out + off * normal);
  }
  return points;
}

ConeStart Near(double half_angle) {
  return {kCenter + Eigen::Vector3d(0.4, -0.3, 0.2), kAxis + Eigen::Vector3d(0, 0.01, 0.005), kRadius + 0.4,
          half_angle};
}

void ExpectTruth(const ConeFit& cone, double half_angle) {
  // Four standard uncertainties each.
  EXPECT_NEAR(cone.half_angle_rad, half_angle, 4 * cone.HalfAngleUncertaintyRad());
  EXPECT_LT(cone.axis.cross(kAxis).norm(), 4 * std::sqrt(cone.covariance(2, 2) + cone.covariance(3, 3)));
  const double along = (cone.axis_point - kCenter).dot(kAxis);
  EXPECT_NEAR(cone.radius_mm, kRadius + along * std::tan(half_angle), 4 * cone.RadiusUncertaintyMm() + 1e-3);
  EXPECT_LT((cone.axis_point - kCenter).cross(kAxis).norm(),
            4 * std::sqrt(cone.covariance(0, 0) + cone.covariance(1, 1)) + 1e-3);
  EXPECT_NEAR(cone.quality.rejected_share(), 0.1, 0.02);
  EXPECT_NEAR(cone.quality.sigma_mm, kNoiseMm, 0.001);
}

TEST(ConeFitTest, Starts) { EXPECT_TRUE(FitCone(Cone(500, kHalfAngle, 360), Near(0.1), {}).ok()); }

TEST(ConeFitTest, FindsTheConeAmongOutliers) {
  for (const double arc_deg : {360.0, 180.0}) {
    const auto cone = FitCone(Cone(20'000, kHalfAngle, arc_deg), Near(0.08), {});
    ASSERT_TRUE(cone.ok()) << cone.error().message;
    ExpectTruth(*cone, kHalfAngle);
    EXPECT_GT(cone->axis.dot(kAxis), 0);
  }
}

// Given the other way round the same cone comes out, with the axis along which it widens.
TEST(ConeFitTest, TheAxisPointsWhereItWidens) {
  ConeStart start = Near(-0.1);
  start.axis = -start.axis;
  const auto cone = FitCone(Cone(20'000, kHalfAngle, 360), start, {});
  ASSERT_TRUE(cone.ok()) << cone.error().message;
  EXPECT_GT(cone->axis.dot(kAxis), 0);
  ExpectTruth(*cone, kHalfAngle);
}

// A cylinder of 3 % taper is refused nowhere, but its cone is found and its form error as a cylinder is told.
TEST(ConeFitTest, ASlightTaperIsTold) {
  const Points points = Cone(20'000, 0.005, 360);
  const auto cone = FitCone(points, Near(0), {});
  ASSERT_TRUE(cone.ok()) << cone.error().message;
  EXPECT_NEAR(cone->half_angle_rad, 0.005, 4 * cone->HalfAngleUncertaintyRad());
  EXPECT_LT(cone->HalfAngleUncertaintyRad(), 1e-4);
}

TEST(ConeFitTest, RefusesWhatDoesNotFixACone) {
  const Points ring = Cone(2000, kHalfAngle, 360, 0);
  EXPECT_FALSE(FitCone(ring, Near(kHalfAngle), {}).ok());
  EXPECT_EQ(FitCone(Points(5, kCenter), Near(0), {}).error().code, ErrorCode::kInvalidArgument);
  Points points = Cone(500, kHalfAngle, 360);
  ConeStart wrong = Near(0);
  wrong.axis.setZero();
  EXPECT_EQ(FitCone(points, wrong, {}).error().code, ErrorCode::kInvalidArgument);
  points[7].y() = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(FitCone(points, Near(0), {}).error().code, ErrorCode::kInvalidArgument);
  EXPECT_TRUE(FitCone(Cone(500, kHalfAngle, 360), Near(0.1), {}).ok());
}

// Too short an arc for a free fit: the axis is held, and the fit says so.
TEST(CylinderFitTest, KeepsAGivenAxis) {
  Points arc = Cone(5000, 0, 90);
  const auto cylinder = FitCylinder(arc, CylinderStart{kCenter, kAxis, kRadius + 0.3, false, true}, {});
  ASSERT_TRUE(cylinder.ok()) << cylinder.error().message;
  EXPECT_TRUE(cylinder->axis_constrained);
  EXPECT_LT(cylinder->axis.cross(kAxis).norm(), 1e-12);
  EXPECT_LT((cylinder->axis_point - kCenter).cross(kAxis).norm(), 1e-9);
  EXPECT_NEAR(cylinder->RadiusUncertaintyMm(), kNoiseMm / std::sqrt(4500.0), 3e-5);
  EXPECT_NEAR(cylinder->radius_mm, kRadius, 4 * cylinder->RadiusUncertaintyMm());
}

}  // namespace
}  // namespace forgescan
