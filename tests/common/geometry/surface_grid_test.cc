#include "services/common/geometry/surface_grid.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>

namespace forgescan {
namespace {

constexpr float kMargin_mm = 20;

// A bumpy sheet of 2 n^2 triangles over 100 x 100 mm, and a far lone triangle.
TriangleMesh Sheet(std::uint32_t n) {
  TriangleMesh mesh;
  const float step = 100.0F / static_cast<float>(n);
  for (std::uint32_t i = 0; i <= n; ++i) {
    for (std::uint32_t j = 0; j <= n; ++j) {
      const float x = step * static_cast<float>(i), y = step * static_cast<float>(j);
      mesh.vertices.emplace_back(x, y, 6 * std::sin(x / 9) * std::cos(y / 7));
    }
  }
  for (std::uint32_t i = 0; i < n; ++i) {
    for (std::uint32_t j = 0; j < n; ++j) {
      const std::uint32_t a = i * (n + 1) + j, b = a + n + 1;
      mesh.triangles.push_back({a, b, b + 1});
      mesh.triangles.push_back({a, b + 1, a + 1});
    }
  }
  const auto first = static_cast<std::uint32_t>(mesh.vertices.size());
  for (const auto& corner : {Eigen::Vector3f(50, 50, 70), {60, 50, 70}, {50, 65, 75}}) {
    mesh.vertices.push_back(corner);
  }
  mesh.triangles.push_back({first, first + 1, first + 2});
  return mesh;
}

struct Built {
  TriangleIndex surface;
  SurfaceGrid grid;
};

Result<Built> Build(const TriangleMesh& mesh, float voxel_mm) {
  ASSIGN_OR_RETURN(TriangleIndex surface, TriangleIndex::Build(mesh));
  Eigen::Vector3f low = mesh.vertices[0], high = low;
  for (const auto& v : mesh.vertices) low = low.cwiseMin(v), high = high.cwiseMax(v);
  ASSIGN_OR_RETURN(SurfaceGrid grid, SurfaceGrid::Build(surface, low, high, {voxel_mm, kMargin_mm}));
  return Built{std::move(surface), std::move(grid)};
}

class SurfaceGridTest : public ::testing::TestWithParam<std::tuple<std::uint32_t, float>> {
 protected:
  void SetUp() override {
    auto built = Build(Sheet(std::get<0>(GetParam())), std::get<1>(GetParam()));
    ASSERT_TRUE(built.ok()) << built.error().message;
    built_.emplace(std::move(*built));
  }
  std::optional<Built> built_;
};

TEST_P(SurfaceGridTest, Starts) {
  EXPECT_FALSE(built_->grid.empty());
  EXPECT_TRUE(Check(built_->grid.arrays(), built_->surface.size()).ok());
}

// The tree alone is the truth: inside the grid, at its border and far outside; within the band and beyond it.
TEST_P(SurfaceGridTest, FindsWhatTheTreeFinds) {
  std::mt19937_64 random(11);
  std::uniform_real_distribution<float> along(-45, 145), up(-50, 120);
  int found = 0;
  for (int i = 0; i < 20'000; ++i) {
    const Eigen::Vector3f p(along(random), along(random), up(random));
    const float reach_mm = i % 2 == 0 ? 3.0F : 25.0F;
    const auto tree = built_->surface.Find(p, reach_mm);
    const auto grid = built_->grid.Find(built_->surface, p, reach_mm);
    ASSERT_EQ(tree.has_value(), grid.has_value()) << p.transpose();
    if (!tree) continue;
    ++found;
    // Single precision; and of distances that differ by 1e-5 of themselves either may be named.
    ASSERT_NEAR(tree->distance_mm, grid->distance_mm, 1e-4F + 1e-5F * tree->distance_mm) << p.transpose();
  }
  EXPECT_GT(found, 1'000);
}

TEST_P(SurfaceGridTest, RoughDistancesAreExactNearTheSurfaceAndCloseFarAway) {
  std::mt19937_64 random(12);
  std::uniform_real_distribution<float> along(0, 100), up(-30, 30);
  const float brick_mm = built_->grid.arrays().voxel_mm * SurfaceGridArrays::kSide;
  for (int i = 0; i < 10'000; ++i) {
    const Eigen::Vector3f p(along(random), along(random), up(random));
    const auto exact = built_->surface.Find(p, 1000);
    const auto rough = built_->grid.FindRoughly(built_->surface, p);
    ASSERT_TRUE(exact && rough);
    // Single precision; and distances that differ by 1e-5 of themselves count as equal.
    const float tie_mm = 1e-4F + 1e-5F * exact->distance_mm;
    ASSERT_GE(rough->distance_mm, exact->distance_mm - tie_mm);
    const float slack_mm = exact->distance_mm < SurfaceGrid::kBand_mm ? tie_mm : std::sqrt(3.0F) * brick_mm;
    ASSERT_LE(rough->distance_mm, exact->distance_mm + slack_mm) << p.transpose();
  }
  EXPECT_TRUE(built_->grid.FindRoughly(built_->surface, {1e6F, -1e6F, 1e6F}));
}

// Few large triangles, many small ones (crowded voxels), voxels wider than the band.
INSTANTIATE_TEST_SUITE_P(Meshes, SurfaceGridTest,
                         ::testing::Combine(::testing::Values(4U, 20U, 80U),
                                            ::testing::Values(2.0F, 4.0F, 16.0F)));

TEST(SurfaceGrid, EqualInputGivesEqualBytes) {
  const auto one = Build(Sheet(20), 4), two = Build(Sheet(20), 4);
  ASSERT_TRUE(one.ok() && two.ok());
  const SurfaceGridArrays &a = one->grid.arrays(), &b = two->grid.arrays();
  EXPECT_TRUE(std::equal(a.tops.begin(), a.tops.end(), b.tops.begin(), b.tops.end()));
  EXPECT_TRUE(std::equal(a.voxels.begin(), a.voxels.end(), b.voxels.begin(), b.voxels.end()));
  EXPECT_TRUE(std::equal(a.lists.begin(), a.lists.end(), b.lists.begin(), b.lists.end()));
}

TEST(SurfaceGrid, NothingForAPointThatIsNotFinite) {
  const auto built = Build(Sheet(4), 4);
  ASSERT_TRUE(built.ok());
  for (const float bad : {std::nanf(""), std::numeric_limits<float>::infinity()}) {
    EXPECT_FALSE(built->grid.Find(built->surface, {1, bad, 1}, 100));
    EXPECT_FALSE(built->grid.FindRoughly(built->surface, {bad, 1, 1}));
  }
  EXPECT_FALSE(built->grid.Find(built->surface, {1, 1, 1}, std::nanf("")));
  EXPECT_TRUE(built->grid.Find(built->surface, {1, 1, 1}, 100));  // and works after the errors
}

TEST(SurfaceGrid, GrowsItsVoxelsInsteadOfItsMemory) {
  TriangleMesh mesh = Sheet(4);
  for (auto& v : mesh.vertices) v *= 100;  // 10 m wide
  const auto built = Build(mesh, 0.5F);
  ASSERT_TRUE(built.ok()) << built.error().message;
  const SurfaceGridArrays& arrays = built->grid.arrays();
  EXPECT_GT(arrays.voxel_mm, 0.5F);
  EXPECT_LE(arrays.tops.size() + arrays.voxels.size() + arrays.lists.size(), std::size_t{16} << 20);
}

TEST(SurfaceGrid, RefusesWrongSizesAndWordsThatLeadNowhere) {
  const auto built = Build(Sheet(20), 4);
  ASSERT_TRUE(built.ok());
  const Eigen::Vector3f low(0, 0, 0), high(1, 1, 1);
  for (const SurfaceGrid::Size& size :
       {SurfaceGrid::Size{0, 10}, {4, -1}, {std::nanf(""), 10}, {4, HUGE_VALF}}) {
    EXPECT_EQ(SurfaceGrid::Build(built->surface, low, high, size).error().code, ErrorCode::kInvalidArgument);
  }
  const SurfaceGridArrays& good = built->grid.arrays();
  EXPECT_FALSE(Check(good, built->surface.size() - 1).ok());  // a triangle that is not there
  SurfaceGridArrays bad = good;
  bad.lists = good.lists.first(good.lists.size() - 1);
  EXPECT_FALSE(Check(bad, built->surface.size()).ok());
  bad = good;
  bad.voxels = good.voxels.first(good.voxels.size() - SurfaceGridArrays::kVoxelsOfBrick);
  EXPECT_FALSE(Check(bad, built->surface.size()).ok());
  bad = good;
  bad.bricks[1] += 1;
  EXPECT_FALSE(Check(bad, built->surface.size()).ok());
  EXPECT_FALSE(Check(SurfaceGridArrays{}, 1).ok());
  // More voxels than single precision tells apart: the last place would lie behind the last brick.
  const std::vector<std::uint32_t> tops((std::size_t{1} << 22) + 1, 0);
  bad = {};
  bad.voxel_mm = 1;
  bad.bricks = {(1U << 22) + 1, 1, 1};
  bad.tops = tops;
  EXPECT_FALSE(Check(bad, 1).ok());
}

}  // namespace
}  // namespace forgescan
