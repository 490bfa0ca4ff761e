#include "tools/forgescan/experiment/ball_scene.h"

#include <cmath>
#include <numbers>

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

}  // namespace forgescan
