#include "services/common/geometry/triangle_index.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <limits>
#include <random>

namespace forgescan {
namespace {

TriangleMesh RandomMesh(std::size_t triangles, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<float> place(-100, 100), size(-8, 8);
  TriangleMesh mesh;
  for (std::uint32_t i = 0; i < triangles; ++i) {
    const Eigen::Vector3f at(place(random) + 900, place(random), place(random));
    for (int corner = 0; corner < 3; ++corner) {
      const float x = size(random), y = size(random), z = size(random);
      mesh.vertices.push_back(at + Eigen::Vector3f(x, y, z));
    }
    mesh.triangles.push_back({3 * i, 3 * i + 1, 3 * i + 2});
  }
  return mesh;
}

// Distance to one triangle the slow way: inside the prism over it, else to the nearest edge; in double
// precision.
double Distance(const Eigen::Vector3d& p, const std::array<Eigen::Vector3d, 3>& t) {
  const Eigen::Vector3d normal = (t[1] - t[0]).cross(t[2] - t[0]);
  bool inside = normal.norm() > 0;
  double nearest = std::numeric_limits<double>::infinity();
  for (std::size_t k = 0; k < 3; ++k) {
    const Eigen::Vector3d a = t[k], edge = t[(k + 1) % 3] - a;
    inside = inside && normal.cross(edge).dot(p - a) >= 0;
    const double along =
        edge.squaredNorm() > 0 ? std::clamp(edge.dot(p - a) / edge.squaredNorm(), 0.0, 1.0) : 0;
    nearest = std::min(nearest, (p - a - along * edge).norm());
  }
  return inside ? std::min(nearest, std::abs(normal.normalized().dot(p - t[0]))) : nearest;
}

double SlowDistance(const TriangleMesh& mesh, const Eigen::Vector3f& p) {
  double best = std::numeric_limits<double>::infinity();
  for (const auto& t : mesh.triangles) {
    best = std::min(best, Distance(p.cast<double>(),
                                   {mesh.vertices[t[0]].cast<double>(), mesh.vertices[t[1]].cast<double>(),
                                    mesh.vertices[t[2]].cast<double>()}));
  }
  return best;
}

TEST(TriangleIndexTest, Starts) { EXPECT_TRUE(TriangleIndex::Build(RandomMesh(1, 1)).ok()); }

TEST(TriangleIndexTest, AgreesWithTheSlowWay) {
  const TriangleMesh mesh = RandomMesh(500, 2);
  const auto index = TriangleIndex::Build(mesh);
  ASSERT_TRUE(index.ok());
  std::mt19937_64 random(3);
  std::uniform_real_distribution<float> place(-130, 130);
  for (int i = 0; i < 500; ++i) {
    const float x = place(random), y = place(random), z = place(random);
    const Eigen::Vector3f p(x + 900, y, z);
    const auto hit = index->Find(p, 1000);
    ASSERT_TRUE(hit);
    EXPECT_NEAR(hit->distance_mm, SlowDistance(mesh, p), 1e-4);  // mm
    EXPECT_NEAR((p - hit->foot).norm(), hit->distance_mm, 1e-4);
    const auto hinted = index->Find(p, 1000, static_cast<std::uint32_t>(i));
    ASSERT_TRUE(hinted);
    EXPECT_EQ(hinted->distance_mm, hit->distance_mm);
    EXPECT_EQ(index->Find(p, 0.5F * hit->distance_mm), std::nullopt);
  }
}

// As CAD tessellates a beam and a fillet: long triangles whose points lie on them all the same.
TEST(TriangleIndexTest, LongNarrowTrianglesAreAsExactAsOthers) {
  for (const Eigen::Vector2f& size : {Eigen::Vector2f(1630, 70), {1800, 5}, {40, 0.1F}}) {
    TriangleMesh mesh;
    mesh.vertices = {{0, 0, 0}, {size.x(), 0, 0}, {size.x(), size.y(), 0}};
    mesh.triangles = {{0, 1, 2}};
    const auto index = TriangleIndex::Build(mesh);
    ASSERT_TRUE(index.ok());
    std::mt19937_64 random(6);
    std::uniform_real_distribution<float> share(0.1F, 0.9F);
    for (int i = 0; i < 500; ++i) {
      const float along = share(random), across = share(random) * along;
      const Eigen::Vector3f on(along * size.x(), across * size.y(), 0);
      EXPECT_NEAR(index->Find(on, 100)->distance_mm, 0, 1e-4);  // mm
      EXPECT_NEAR(index->Find(on + 2 * Eigen::Vector3f::UnitZ(), 100)->distance_mm, 2, 1e-4);
    }
  }
}

// What lies beside a long narrow triangle is not over it, however the triangle is turned.
TEST(TriangleIndexTest, BesideLongNarrowTrianglesTheEdgeIsNearest) {
  std::mt19937_64 random(8);
  std::uniform_real_distribution<double> share(0, 1), part(-1, 1);
  for (int i = 0; i < 3000; ++i) {
    const double width = std::array{1.0, 0.1, 0.01}[static_cast<std::size_t>(i % 3)];
    const double x = part(random), y = part(random), z = part(random);
    const Eigen::Quaterniond turn = Eigen::Quaterniond(part(random), x, y, z).normalized();
    TriangleMesh mesh;
    for (const Eigen::Vector3d& corner :
         {Eigen::Vector3d(-900, 0, 0), {900, 0, 0}, {1800 * (share(random) - 0.5), width, 0}}) {
      mesh.vertices.push_back((turn * corner).cast<float>());
    }
    mesh.triangles = {{0, 1, 2}};
    const auto index = TriangleIndex::Build(mesh);
    ASSERT_TRUE(index.ok());
    const auto edge = static_cast<std::size_t>(i / 3 % 3);
    const Eigen::Vector3d a = mesh.vertices[edge].cast<double>();
    const Eigen::Vector3d b = mesh.vertices[(edge + 1) % 3].cast<double>();
    const Eigen::Vector3d beyond = (b - a).normalized().cross(turn * Eigen::Vector3d::UnitZ());
    const double off_mm = std::pow(10, -2 + 3 * share(random));  // 0.01 to 10
    const Eigen::Vector3f p = (a + share(random) * (b - a) + off_mm * beyond).cast<float>();
    EXPECT_NEAR(index->Find(p, 100)->distance_mm, SlowDistance(mesh, p), 3e-4)  // mm; single precision
        << width << " mm wide, " << off_mm << " mm beyond edge " << edge;
  }
}

TEST(TriangleIndexTest, TrianglesWithoutAreaAreEdges) {
  TriangleMesh mesh;
  mesh.vertices = {{0, 0, 0}, {10, 0, 0}, {5, 5, 5}};
  mesh.triangles = {{0, 1, 1}, {2, 2, 2}};
  const auto index = TriangleIndex::Build(mesh);
  ASSERT_TRUE(index.ok());
  EXPECT_NEAR(index->Find({5, -2, 0}, 100)->distance_mm, 2, 1e-5);
  EXPECT_NEAR(index->Find({13, 4, 0}, 100)->distance_mm, 5, 1e-5);
  EXPECT_NEAR(index->Find({5, 5, 7}, 100)->distance_mm, 2, 1e-5);
  EXPECT_EQ(index->Normal(0), Eigen::Vector3f::Zero());
}

TEST(TriangleIndexTest, TheFacingTriangleOwnsASharedEdge) {
  TriangleMesh mesh;  // a roof: ridge along x, the left side steep, the right side flat
  mesh.vertices = {{0, 0, 0}, {10, 0, 0}, {5, -1, -9}, {5, 9, -1}};
  mesh.triangles = {{0, 2, 1}, {0, 1, 3}};
  const auto index = TriangleIndex::Build(mesh);
  ASSERT_TRUE(index.ok());
  const auto above = index->Find({5, 0.1F, 2}, 10);
  ASSERT_TRUE(above);
  EXPECT_EQ(above->triangle, 1U);  // its normal points up
}

TEST(TriangleIndexTest, NotFiniteAndOutOfRange) {
  const auto index = TriangleIndex::Build(RandomMesh(10, 4));
  ASSERT_TRUE(index.ok());
  EXPECT_EQ(index->Find({std::nanf(""), 0, 0}, 1e6F), std::nullopt);
  EXPECT_EQ(index->Find({900, 0, 0}, std::nanf("")), std::nullopt);
  EXPECT_FALSE(TriangleIndex::Build(TriangleMesh{}).ok());
  TriangleMesh bad = RandomMesh(2, 5);
  bad.triangles[1][2] = 6;
  EXPECT_EQ(TriangleIndex::Build(bad).error().code, ErrorCode::kInvalidArgument);
  bad = RandomMesh(2, 5);
  bad.vertices[1].x() = std::numeric_limits<float>::infinity();
  EXPECT_EQ(TriangleIndex::Build(bad).error().code, ErrorCode::kInvalidArgument);
}

}  // namespace
}  // namespace forgescan
