#include "services/common/features/deviation_surface.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <limits>
#include <random>

#include "tests/common/shapes/test_axle.h"

namespace forgescan {
namespace {

constexpr float kNan = std::numeric_limits<float>::quiet_NaN();

// A wavy sheet over x, y in [-10, 10] mm, whose normals point up.
struct Sheet {
  std::vector<Eigen::Vector3f> vertices;
  std::vector<TriangleCorners> triangles;
};

Sheet WavySheet(int side) {
  Sheet sheet;
  for (int j = 0; j <= side; ++j) {
    for (int i = 0; i <= side; ++i) {
      const float x = 20.0F * static_cast<float>(i) / static_cast<float>(side) - 10;
      const float y = 20.0F * static_cast<float>(j) / static_cast<float>(side) - 10;
      sheet.vertices.emplace_back(x, y, 1.5F * std::sin(0.7F * x) * std::cos(0.6F * y));
    }
  }
  const auto at = [side](int i, int j) { return static_cast<std::uint32_t>(j * (side + 1) + i); };
  for (int j = 0; j < side; ++j) {
    for (int i = 0; i < side; ++i) {
      sheet.triangles.push_back({at(i, j), at(i + 1, j), at(i + 1, j + 1)});
      sheet.triangles.push_back({at(i, j), at(i + 1, j + 1), at(i, j + 1)});
    }
  }
  return sheet;
}

PointCloud Scatter(std::size_t count, double reach_mm, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<float> place(-11, 11);
  std::uniform_real_distribution<float> height(static_cast<float>(-reach_mm), static_cast<float>(reach_mm));
  PointCloud cloud;
  for (std::size_t i = 0; i < count; ++i) {
    const float x = place(random), y = place(random);
    cloud.points.emplace_back(x, y, height(random));
  }
  return cloud;
}

// Nearest point of one triangle in double precision, by its sides and its plane.
double Distance(const Eigen::Vector3d& p, const std::array<Eigen::Vector3d, 3>& corners) {
  const Eigen::Vector3d normal = (corners[1] - corners[0]).cross(corners[2] - corners[0]);
  double nearest = std::numeric_limits<double>::max();
  bool inside = normal.norm() > 0;
  for (std::size_t i = 0; i < 3; ++i) {
    const Eigen::Vector3d side = corners[(i + 1) % 3] - corners[i], arm = p - corners[i];
    const double share = std::clamp(arm.dot(side) / std::max(side.squaredNorm(), 1e-30), 0.0, 1.0);
    nearest = std::min(nearest, (arm - share * side).norm());
    inside = inside && side.cross(arm).dot(normal) >= 0;
  }
  return inside ? std::abs(normal.normalized().dot(p - corners[0])) : nearest;
}

// The plain way: every point against every triangle.
std::vector<float> PlainDeviations(const PointCloud& cloud, const std::vector<Eigen::Vector3f>& vertices,
                                   const std::vector<TriangleCorners>& triangles, double max_mm) {
  std::vector<float> deviations;
  for (const Eigen::Vector3f& point : cloud.points) {
    const Eigen::Vector3d p = point.cast<double>();
    double best = max_mm, height = kNan;
    for (const TriangleCorners& t : triangles) {
      const std::array<Eigen::Vector3d, 3> corners{
          vertices[t[0]].cast<double>(), vertices[t[1]].cast<double>(), vertices[t[2]].cast<double>()};
      const double distance = Distance(p, corners);
      if (distance > best + 1e-9) continue;
      const double over =
          (corners[1] - corners[0]).cross(corners[2] - corners[0]).normalized().dot(p - corners[0]);
      if (distance < best - 1e-9 || !(std::abs(over) <= std::abs(height))) height = over;
      best = std::min(best, distance);
    }
    deviations.push_back(static_cast<float>(std::isnan(height) ? height : std::copysign(best, height)));
  }
  return deviations;
}

void ExpectSame(const std::vector<float>& ours, const std::vector<float>& plain) {
  ASSERT_EQ(ours.size(), plain.size());
  for (std::size_t i = 0; i < ours.size(); ++i) {
    ASSERT_EQ(std::isnan(ours[i]), std::isnan(plain[i])) << i << ": " << ours[i] << ", " << plain[i];
    if (std::isnan(ours[i])) continue;
    // 1e-4 mm: single precision over a 2 m part. Nearer to the surface than that a sign means nothing.
    ASSERT_NEAR(std::abs(ours[i]), std::abs(plain[i]), 1e-4) << i;
    if (std::abs(plain[i]) > 2e-4F) {
      ASSERT_EQ(ours[i] > 0, plain[i] > 0) << i << ": " << ours[i] << ", " << plain[i];
    }
  }
}

TEST(DeviationSurfaceTest, Starts) {
  const Sheet sheet = WavySheet(1);
  EXPECT_TRUE(DeviationSurface::Build(sheet.vertices, sheet.triangles).ok());
}

// From one leaf, not full, to five levels; points near and far, beside the rim, and in no order.
TEST(DeviationSurfaceTest, AgreesWithThePlainSearch) {
  for (const int side : {1, 2, 7, 40, 120}) {
    const Sheet sheet = WavySheet(side);
    const auto surface = DeviationSurface::Build(sheet.vertices, sheet.triangles);
    ASSERT_TRUE(surface.ok());
    const PointCloud cloud = Scatter(side > 50 ? 500 : 3000, 6, 4);
    ExpectSame(SignedDeviations(cloud, *surface, 3, 2),
               PlainDeviations(cloud, sheet.vertices, sheet.triangles, 3));
  }
}

TEST(DeviationSurfaceTest, AgreesOnAPartWithEdgesAndLongTriangles) {
  const auto model = testing::MakeAxle({}, 8);
  ASSERT_TRUE(model.ok());
  const auto surface = DeviationSurface::Build(model->vertices, model->triangles);
  ASSERT_TRUE(surface.ok());
  const PointCloud cloud = testing::ScanOf(*model, {5'000, 0.2, 1.5, 3});
  ExpectSame(SignedDeviations(cloud, *surface, 20, 2),
             PlainDeviations(cloud, model->vertices, model->triangles, 20));
}

TEST(DeviationSurfaceTest, SignsAreThoseOfTheSideAndNaNFarAway) {
  const auto model = testing::MakeAxle({}, 8);
  ASSERT_TRUE(model.ok());
  const auto surface = DeviationSurface::Build(model->vertices, model->triangles);
  ASSERT_TRUE(surface.ok());
  PointCloud cloud;
  // Above and below the beam's top (z = 40), over its edge, too far away, and no point at all.
  cloud.points = {{0, 0, 40.5F}, {0, 0, 39.5F}, {0, 35.3F, 40.4F},
                  {0, 0, 60},    {kNan, 0, 0},  {0, 0, std::numeric_limits<float>::infinity()}};
  const auto deviations = SignedDeviations(cloud, *surface, 3, 1);
  EXPECT_NEAR(deviations[0], 0.5, 1e-4);  // mm: single precision
  EXPECT_NEAR(deviations[1], -0.5, 1e-4);
  EXPECT_NEAR(deviations[2], 0.5, 1e-4);  // 0.3, 0.4
  for (std::size_t i = 3; i < 6; ++i) EXPECT_TRUE(std::isnan(deviations[i])) << i;
  for (const float value : SignedDeviations(cloud, *surface, std::nan(""), 1)) EXPECT_TRUE(std::isnan(value));
}

TEST(DeviationSurfaceTest, SameBytesForAnyThreadsAndOnEveryPath) {
  const Sheet sheet = WavySheet(60);
  const auto surface = DeviationSurface::Build(sheet.vertices, sheet.triangles);
  ASSERT_TRUE(surface.ok());
  const PointCloud cloud = Scatter(30'000, 4, 9);
  const auto one = SignedDeviations(cloud, *surface, 3, 1);
  for (const unsigned threads : {2U, 4U}) {
    const auto more = SignedDeviations(cloud, *surface, 3, threads);
    EXPECT_EQ(std::memcmp(one.data(), more.data(), one.size() * sizeof(float)), 0) << threads;
  }
  std::vector<float> plain(cloud.size()), best(cloud.size());
  surface->Deviations(cloud.points, 3, plain, SimdPath::kPlain);
  surface->Deviations(cloud.points, 3, best, BestSimdPath());
  EXPECT_EQ(std::memcmp(plain.data(), best.data(), plain.size() * sizeof(float)), 0);
}

TEST(DeviationSurfaceTest, TrianglesWithoutAreaAreStillEdges) {
  const std::vector<Eigen::Vector3f> vertices{{0, 0, 0}, {10, 0, 0}, {10, 0, 0}, {5, 0, 0}};
  const auto surface = DeviationSurface::Build(vertices, {{0, 1, 2}, {0, 3, 1}, {2, 2, 2}});
  ASSERT_TRUE(surface.ok());
  PointCloud cloud;
  cloud.points = {{5, 1, 0}, {12, 0, 0}};
  const auto deviations = SignedDeviations(cloud, *surface, 3, 1);
  EXPECT_NEAR(std::abs(deviations[0]), 1, 1e-6);
  EXPECT_NEAR(std::abs(deviations[1]), 2, 1e-6);
}

TEST(DeviationSurfaceTest, RefusesAMeshThatIsNone) {
  const std::vector<Eigen::Vector3f> vertices{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
  EXPECT_EQ(DeviationSurface::Build(vertices, {}).error().code, ErrorCode::kInvalidArgument);
  EXPECT_EQ(DeviationSurface::Build(vertices, {{0, 1, 3}}).error().code, ErrorCode::kInvalidArgument);
  EXPECT_EQ(DeviationSurface::Build({{0, 0, 0}, {1, 0, 0}, {0, kNan, 0}}, {{0, 1, 2}}).error().code,
            ErrorCode::kInvalidArgument);
  EXPECT_TRUE(DeviationSurface::Build(vertices, {{0, 1, 2}}).ok());
}

}  // namespace
}  // namespace forgescan
