#include "tools/forgescan/experiment/ball_scene.h"

#include <cmath>
#include <numbers>

#include "services/common/calibration/rig_geometry.h"
#include "tools/forgescan/experiment/draws.h"
#include "tools/virtual_station/scene.h"
#include "tools/virtual_station/teaching.h"

namespace forgescan {
namespace {

constexpr int kSegments = 480;  // of a circle

SurfaceMesh BallMesh(const Eigen::Vector3d& center) {
  SurfaceMesh mesh;
  constexpr int kRings = kSegments / 2;
  for (int ring = 0; ring <= kRings; ++ring) {
    const double polar = std::numbers::pi * ring / kRings;
    for (int i = 0; i < kSegments; ++i) {
      const double around = 2 * std::numbers::pi * i / kSegments;
      const Eigen::Vector3d outward(std::sin(polar) * std::cos(around), std::sin(polar) * std::sin(around),
                                    std::cos(polar));
      mesh.vertices.emplace_back(center + kBallRadiusMm * outward);
    }
  }
  for (int ring = 0; ring < kRings; ++ring) {
    for (int i = 0; i < kSegments; ++i) {
      const int a = ring * kSegments + i, b = ring * kSegments + (i + 1) % kSegments;
      if (ring > 0) mesh.triangles.push_back({a, b + kSegments, b});
      if (ring + 1 < kRings) mesh.triangles.push_back({a, a + kSegments, b + kSegments});
    }
  }
  return mesh;
}

// From the middle of the view's field, rig frame: x right, y down, z away from the camera.
Eigen::Vector3d InArray(const CellConfig& config, const Eigen::Vector3d& from_middle) {
  return TaughtRigPose(config.views.front(), config.working_distance_mm) *
         (from_middle + Eigen::Vector3d(0, 0, config.working_distance_mm));
}

// About the pair, in sight of cameras and projector.
std::vector<BoxConfig> Blocks(const CellConfig& config) {
  constexpr double kHalfMm = 15;
  std::vector<BoxConfig> boxes;
  for (const double x : {-105.0, 0.0, 105.0}) {
    for (const double y : {-75.0, 75.0}) {
      const Eigen::Vector3d middle = InArray(config, {x, y, 0});
      const Eigen::Vector3d half = Eigen::Vector3d::Constant(kHalfMm);
      boxes.push_back({middle - half, middle + half});
    }
  }
  return boxes;
}

struct Placed {
  Eigen::Vector3d middle_mm;  // from the middle of the field, rig frame
  Eigen::Vector3d along;
};

}  // namespace

CellConfig BarCell(CellConfig config) {
  config.views = {{{0, 0, 0}, {1, 1, 1}, {-1, 1, 0}, 1.0}};
  config.boxes.clear();
  config.posts.clear();
  config.surface.texture_contrast = 0;
  config.part.odd_parts.clear();
  return config;
}

CellConfig BallCell(CellConfig config) {
  config = BarCell(std::move(config));
  config.boxes = Blocks(config);
  return config;
}

BallPair PairCenters(const CellConfig& config) {
  const Eigen::Vector3d half = 0.5 * kBallDistanceMm * Eigen::Vector3d(1, 0.035, 0.389).normalized();
  return {InArray(config, -half), InArray(config, half)};
}

std::vector<BallPair> BarPlacements(const CellConfig& config, double distance_mm) {
  const std::vector<Placed> planned = {
      {{-50, -100, 0}, {1, 0, 0}},    {{50, -100, 0}, {1, 0, 0}},     {{-50, 100, 0}, {1, 0, 0}},
      {{50, 100, 0}, {1, 0, 0}},      {{0, 0, 0}, {1, 0, 0}},         {{-100, -50, 0}, {0, 1, 0}},
      {{-100, 50, 0}, {0, 1, 0}},     {{100, -50, 0}, {0, 1, 0}},     {{100, 50, 0}, {0, 1, 0}},
      {{0, 0, -70}, {1, 0, 0}},       {{0, 0, -70}, {0, 1, 0}},       {{-75, 0, 70}, {1, 0, 0}},
      {{75, 0, 70}, {1, 0, 0}},       {{0, 70, 70}, {0, 1, 0}},       {{-65, -60, 0}, {0.6, 0, 0.8}},
      {{65, -60, 0}, {-0.6, 0, 0.8}}, {{-65, 60, 0}, {-0.6, 0, 0.8}}, {{65, 60, 0}, {0.6, 0, 0.8}},
      {{0, -65, 0}, {0, 0.6, 0.8}},   {{0, 65, 0}, {0, -0.6, 0.8}}};
  constexpr double kByHandMm = 5, kByHandRad = 0.05;
  RandomStream random = DrawsOf(config.seed, Draw::kBallBar);
  std::vector<BallPair> placements;
  for (const Placed& place : planned) {
    const Eigen::Isometry3d by_hand = SmallMotion(random, kByHandMm, kByHandRad);
    const Eigen::Vector3d half = 0.5 * distance_mm * (by_hand.linear() * place.along.normalized());
    const Eigen::Vector3d middle = place.middle_mm + by_hand.translation();
    placements.push_back({InArray(config, middle - half), InArray(config, middle + half)});
  }
  return placements;
}

PartState BallPart(std::span<const Eigen::Vector3d> centers) {
  PartState part;
  part.start_degc = 925;  // never used: the balls are cold
  for (const Eigen::Vector3d& center : centers) Append(BallMesh(center), part.mesh_in_part);
  return part;
}

BallPair SeenBy(const StereoCalibration& calibration, const CellConfig& config, const BallPair& in_array) {
  const RigGeometry truth(CalibrationOf(config.rig));
  const Eigen::Isometry3d left_from_array =
      config.rig.left.camera_from_rig *
      TaughtRigPose(config.views.front(), config.working_distance_mm).inverse();
  BallPair in_camera;
  for (std::size_t i = 0; i < 2; ++i) in_camera[i] = truth.CameraFromLeft(left_from_array * in_array[i]);
  const std::vector<Eigen::Vector3d> found = RigGeometry(calibration).Triangulated(truth.Seen(in_camera));
  return {found[0], found[1]};
}

}  // namespace forgescan
