#include "tools/forgescan/experiment/ball_scene.h"

#include <cmath>
#include <numbers>

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

}  // namespace

std::array<Eigen::Vector3d, 2> BallCenters() {
  const Eigen::Vector3d along = Eigen::Vector3d(1.0, 0.25, 0.3).normalized();
  return {-0.5 * kBallDistanceMm * along, 0.5 * kBallDistanceMm * along};
}

CellConfig BallCell(CellConfig config) {
  config.views = {{{0, 0, 0}, {0, 0.7, 0.7}, {-1, 0, 0}, 1.0}};
  config.boxes = {{{-120, -80, -70}, {120, 80, -60}}};
  config.posts.clear();
  config.surface.texture_contrast = 0;
  config.part.odd_parts.clear();
  return config;
}

PartState BallPart() {
  PartState part;
  part.start_degc = 925;  // never used: the balls are cold
  for (const Eigen::Vector3d& center : BallCenters()) Append(BallMesh(center), part.mesh_in_part);
  return part;
}

double DistanceByCalibration(const CellConfig& config) {
  const Rig calibrated = CalibratedRig(config);
  const Rectification rectification = Rectify(calibrated);
  const Eigen::Isometry3d rig_from_array =
      TaughtRigPose(config.views.front(), config.working_distance_mm).inverse();
  std::array<Eigen::Vector3d, 2> seen;
  for (std::size_t i = 0; i < seen.size(); ++i) {
    const auto ray = [&](const PinholeCamera& truth, const Lens& written, const Eigen::Matrix3d& rectified) {
      const Eigen::Vector3d p_in_camera = truth.camera_from_rig * (rig_from_array * BallCenters()[i]);
      const Eigen::Vector2d slope = Unproject(written, Project(truth.lens, p_in_camera));
      const Eigen::Vector3d direction = rectified * slope.homogeneous();
      return Eigen::Vector3d(direction / direction.z());
    };
    const Eigen::Vector3d left =
        ray(config.rig.left, calibrated.left.lens, rectification.rectified_from_left);
    const Eigen::Vector3d right =
        ray(config.rig.right, calibrated.right.lens, rectification.rectified_from_right);
    seen[i] = left * (rectification.baseline_mm / (left.x() - right.x()));
  }
  return (seen[1] - seen[0]).norm();
}

}  // namespace forgescan
