#include "services/reconstruction/projector_consistency.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <random>
#include <vector>

namespace forgescan {
namespace {

constexpr double kPlainMm = 120;

// Points over a field of 30 degrees at depth_mm(x, y) (x, y: tangents), lit by a projector of f = 800 px that
// stands half a baseline to the right of the camera.
std::vector<LitPoint> Lit(const std::function<double(double, double)>& depth_mm) {
  std::mt19937 random(7);
  std::uniform_real_distribution<double> tangent(-0.27, 0.27);
  std::vector<LitPoint> points;
  for (int i = 0; i < 2000; ++i) {
    const double x = tangent(random), y = tangent(random), z = depth_mm(x, y);
    const double column_px = 255.5 + 800 * (x * z - kPlainMm / 2) / z;
    points.push_back({Eigen::Vector3d(x * z, y * z, z).cast<float>(), static_cast<float>(column_px)});
  }
  return points;
}

double Hilly(double x, double y) { return 400 + 60 * std::sin(9 * x) * std::cos(7 * y); }
double Flat(double x, double y) { return 400 / (1 + 0.3 * x - 0.1 * y); }

TEST(ProjectorConsistency, StartsAndFindsTheProjector) {
  const auto figures = MeasureProjectorConsistency(Lit(Hilly), kPlainMm);
  ASSERT_TRUE(figures.has_value());
  EXPECT_LT(figures->column_rms_px, 1e-3);  // px; single precision
  // The cameras' baseline is twice the projector's; a projective function of the image can copy some of the
  // relief, an affine one less.
  EXPECT_NEAR(figures->flat_parallax_px / figures->flat_column_rms_px, 2, 0.4);
}

TEST(ProjectorConsistency, AFlatSceneLeavesTheProjectorOpenButFitsIt) {
  const auto figures = MeasureProjectorConsistency(Lit(Flat), kPlainMm);
  ASSERT_TRUE(figures.has_value());
  EXPECT_LT(figures->column_rms_px, 1e-3);
  EXPECT_LT(figures->flat_column_rms_px, 1e-3);
  EXPECT_LT(figures->flat_parallax_px, 1e-3);
}

TEST(ProjectorConsistency, ReliefThatTheProjectorDoesNotSeeShows) {
  std::vector<LitPoint> points = Lit(Flat);
  for (LitPoint& point : points) {  // along the rays of the camera: no column changes
    const float x = point.p_in_camera.x() / point.p_in_camera.z();
    point.p_in_camera *= 1 + 0.2f * x * x;
  }
  const auto figures = MeasureProjectorConsistency(points, kPlainMm);
  ASSERT_TRUE(figures.has_value());
  EXPECT_LT(figures->column_rms_px, 1e-3);  // px; a projector in the camera explains them
  EXPECT_GT(figures->flat_parallax_px, 0.3);
}

TEST(ProjectorConsistency, WrongDepthsShowAndAFewWrongColumnsDoNot) {
  std::vector<LitPoint> points = Lit(Hilly);
  for (std::size_t i = 0; i < points.size(); i += 20) {
    points[i].coordinate_px += 28;  // a wrong fringe order in 5 % of the points
  }
  const auto few_wrong = MeasureProjectorConsistency(points, kPlainMm);
  ASSERT_TRUE(few_wrong.has_value());
  EXPECT_LT(few_wrong->column_rms_px, 0.01);
  for (LitPoint& point : points) {
    const float x = point.p_in_camera.x() / point.p_in_camera.z();
    point.p_in_camera *= 1 + 3 * x * x;  // bent; turning the relief inside out would be a projective map
  }
  const auto all_wrong = MeasureProjectorConsistency(points, kPlainMm);
  ASSERT_TRUE(all_wrong.has_value());
  EXPECT_GT(all_wrong->column_rms_px, 0.15);
}

TEST(ProjectorConsistency, TooFewOrEqualPointsAreNoFigureOrZero) {
  const std::vector<LitPoint> equal(kMinLitPoints, {Eigen::Vector3f(1, 2, 400), 100.0f});
  const auto figures = MeasureProjectorConsistency(equal, kPlainMm);
  ASSERT_TRUE(figures.has_value());
  EXPECT_LT(figures->column_rms_px, 1e-3);
  const std::span<const LitPoint> few(equal.data(), kMinLitPoints - 1);
  EXPECT_FALSE(MeasureProjectorConsistency(few, kPlainMm).has_value());
}

}  // namespace
}  // namespace forgescan
