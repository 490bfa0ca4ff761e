#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "tools/virtual_station/virtual_cell.h"

namespace forgescan {
namespace {

const std::string kCell = std::string(FORGESCAN_SOURCE_DIR) + "/stations/virtual/cell.toml";
constexpr int kDivisor = 8;  // 304 x 256 px: enough to test what does not depend on size

CellConfig Config() {
  auto config = LoadCellConfig(kCell, kDivisor);
  EXPECT_TRUE(config.ok());
  return *config;
}

// A tilted square of 400 mm at the working distance, in the rig frame.
SurfaceMesh TiltedSquare(double distance_mm) {
  SurfaceMesh mesh;
  for (const auto& [x, y] : {std::pair{-200.0, -200.0}, {200.0, -200.0}, {200.0, 200.0}, {-200.0, 200.0}}) {
    mesh.vertices.emplace_back(x, y, distance_mm + 0.2 * x - 0.1 * y);
  }
  mesh.triangles = {{0, 2, 1}, {0, 3, 2}};
  return mesh;
}

TEST(Rendering, ProjectorCoordinateEqualsAnIndependentComputation) {
  const CellConfig config = Config();
  const double distance = config.working_distance_mm;
  const auto scene = PosedScene::Build(TiltedSquare(distance), Eigen::Isometry3d::Identity(), 1.0, {});
  ASSERT_TRUE(scene.ok());
  ShadingSettings shading;
  shading.sensor = config.sensor;
  shading.surface = config.surface;
  shading.working_distance_mm = distance;
  const RayTable rays = BuildRayTable(config.rig.right, 1);
  const GeometryMap map =
      BuildGeometryMap(*scene, {config.rig, Side::kRight, rays, Eigen::Isometry3d::Identity(), shading, 1});
  const Eigen::Isometry3d camera_from_rig = config.rig.right.camera_from_rig;
  int compared = 0;
  for (int y = 20; y < map.height; y += 37) {
    for (int x = 20; x < map.width; x += 41) {
      const SurfaceSample& sample = map.sample[static_cast<std::size_t>(y * map.width + x)];
      if (sample.lit == 0.0f) {
        continue;
      }
      // The plane z = distance + 0.2 x - 0.1 y met by the line centre + s * direction.
      const Eigen::Vector3d centre = camera_from_rig.inverse().translation();
      const Eigen::Vector3d direction =
          camera_from_rig.linear().transpose() * Unproject(config.rig.right.lens, {x, y}).homogeneous();
      const Eigen::Vector3d normal(0.2, -0.1, -1.0);
      const double s = -(distance + normal.dot(centre)) / normal.dot(direction);
      const Eigen::Vector2d expected =
          Project(config.rig.projector.lens, config.rig.projector.camera_from_rig * (centre + s * direction));
      EXPECT_NEAR(sample.u_px, expected.x(), 5e-4);  // px: float of the ray table and of u itself
      ++compared;
    }
  }
  EXPECT_GT(compared, 15);
}

TEST(Rendering, SameBytesOnAnyNumberOfThreads) {
  std::vector<std::vector<std::uint8_t>> images;
  for (const int threads : {1, 2, 3}) {
    const VirtualCell cell(Config(), threads);
    const auto part = cell.Part(2);
    ASSERT_TRUE(part.ok());
    const auto view = cell.View(*part, 1);
    ASSERT_TRUE(view.ok());
    const auto map = cell.Map(*part, *view, Side::kLeft);
    ASSERT_TRUE(map.ok());
    images.push_back(cell.Image(*map, *view, Side::kLeft, cell.Patterns(ProjectedSet::kReduced)[3], 3));
  }
  EXPECT_EQ(images[0], images[1]);
  EXPECT_EQ(images[0], images[2]);
}

TEST(Rendering, AVisitOfItsOwnGivesAnImageOfItsOwn) {
  const VirtualCell cell(Config(), 2);
  const auto part = cell.Part(2);
  ASSERT_TRUE(part.ok());
  const auto image = [&](int visit) {
    const auto view = cell.View(*part, 1, 15.0, visit);
    EXPECT_TRUE(view.ok());
    const auto map = cell.Map(*part, *view, Side::kLeft);
    EXPECT_TRUE(map.ok());
    return cell.Image(*map, *view, Side::kLeft, cell.Patterns(ProjectedSet::kReduced)[3], 3);
  };
  EXPECT_EQ(image(1), image(1));
  EXPECT_NE(image(0), image(1));
  EXPECT_NE(cell.View(*part, 1, 15.0, 0)->pyrometer_degc, cell.View(*part, 1, 15.0, 1)->pyrometer_degc);
}

// The posts are there for the robot's error; they must cost no point of the part.
TEST(Rendering, PostsHideNothingOfThePart) {
  auto config = LoadCellConfig(kCell, 8);
  ASSERT_TRUE(config.ok()) << config.error().message;
  const VirtualCell with(*config, 2);
  config->posts.clear();
  const VirtualCell without(*config, 2);
  const auto part = with.Part(2);
  ASSERT_TRUE(part.ok()) << part.error().message;
  const auto lit_of_part = [&](const VirtualCell& cell, int view) {
    const auto map = cell.Map(*part, *cell.View(*part, view), Side::kLeft);
    std::size_t count = 0;
    for (std::size_t i = 0; i < map->sample.size(); ++i) {
      count += map->surface[i] == Surface::kPart && map->sample[i].lit > 0 ? 1 : 0;
    }
    return count;
  };
  for (int view = 0; view < static_cast<int>(config->views.size()); ++view) {
    const double before = static_cast<double>(lit_of_part(without, view));
    EXPECT_GT(static_cast<double>(lit_of_part(with, view)), 0.998 * before)
        << "view " << view;  // the beam's foot
  }
}

TEST(Rendering, ForeignShareAsInThePaper) {
  CellConfig config = Config();
  config.posts.clear();  // the paper's cell has none
  const VirtualCell cell(config, 2);
  const auto part = cell.Part(0);
  ASSERT_TRUE(part.ok());
  const double usable_dn = 8.0 / cell.config().projector_light.amplitude;  // modulation of 8 DN
  double of_part = 0, foreign = 0;
  for (int i = 0; i < 10; ++i) {
    const auto view = cell.View(*part, i);
    ASSERT_TRUE(view.ok());
    for (const Side side : {Side::kLeft, Side::kRight}) {
      const auto map = cell.Map(*part, *view, side);
      ASSERT_TRUE(map.ok());
      for (std::size_t p = 0; p < map->sample.size(); ++p) {
        if (map->sample[p].lit >= usable_dn) {
          (map->surface[p] == Surface::kPart ? of_part : foreign) += 1.0;
        }
      }
    }
  }
  EXPECT_NEAR(foreign / (of_part + foreign), 0.22,
              0.04);  // the paper says 22 %, of another axle on another conveyor
}

TEST(Rendering, ImagesFollowTheirFormula) {
  CellConfig config = Config();
  config.sensor.read_noise_dn = 0.0;
  config.sensor.gain_dn = 0.0;
  config.projector_light.level_sd = 0.0;
  const ProjectorLightConfig light = config.projector_light;
  GeometryMap map;
  map.width = 64;
  map.height = 1;
  for (int x = 0; x < map.width; ++x) {
    map.sample.push_back({-0.5f + 1.7f * static_cast<float>(x), 150.0f, 10.0f});
    map.surface.push_back(Surface::kPart);
  }
  map.sample[5].lit = 0.0f;
  map.sample[6].lit = 1e4f;
  const Pattern pattern{31.0, 90.0};
  const auto image = ExposeImage(map, {light, config.sensor, pattern, {}, 1});
  for (std::size_t x = 7; x < image.size(); ++x) {
    const double expected = 10.0 + 150.0 * PatternLevel(light, pattern, map.sample[x].u_px);
    EXPECT_NEAR(image[x], expected, 0.52);  // DN: rounding, and the table of levels
  }
  EXPECT_EQ(image[5], 10);
  EXPECT_EQ(image[6], 255);  // saturated, not wrapped round
}

TEST(Rendering, NoiseHasTheSensorsVariance) {
  CellConfig config = Config();
  config.sensor.read_noise_dn = 1.0;
  config.sensor.gain_dn = 0.02;
  GeometryMap map;
  map.width = 512;
  map.height = 64;
  map.sample.assign(512 * 64, {0.0f, 0.0f, 100.0f});
  const auto image =
      ExposeImage(map, {config.projector_light, config.sensor, {}, {1, 2, 3, 0, Side::kLeft, 4}, 1});
  double sum = 0, square = 0;
  for (const auto grey : image) {
    sum += grey;
    square += grey * grey;
  }
  const double n = static_cast<double>(image.size());
  const double variance = square / n - sum / n * (sum / n);
  EXPECT_NEAR(sum / n, 100.0, 0.05);  // DN: 5 sigma of the mean
  EXPECT_NEAR(variance, 1.0 + 0.02 * 100.0 + 1.0 / 12.0,
              0.15);  // DN^2: 5 sigma of the variance; 1/12 is rounding
}

TEST(Rendering, RefusesViewsThatDoNotExist) {
  const VirtualCell cell(Config(), 1);
  EXPECT_FALSE(cell.Part(-1).ok());
  EXPECT_FALSE(cell.View(PartState{}, 10).ok());
}

}  // namespace
}  // namespace forgescan
