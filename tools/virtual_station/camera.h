// Pinhole cameras with lens distortion, and the rig of two cameras and a projector.
//
// Source: the OpenCV camera model (K, k1 k2 p1 p2 k3). Units: mm, px. Frames: camera frames have x right, y
// down, z forward; "rig" has its origin midway between the cameras, x from the left to the right camera, z
// towards the scene. Pixel centres are at integers.
#pragma once

#include <Eigen/Geometry>
#include <array>

namespace forgescan {

struct Lens {
  double fx_px = 0.0, fy_px = 0.0, cx_px = 0.0, cy_px = 0.0;
  std::array<double, 5> distortion{};  // k1, k2, p1, p2, k3
};

struct PinholeCamera {
  Lens lens;
  int width_px = 0, height_px = 0;
  Eigen::Isometry3d camera_from_rig = Eigen::Isometry3d::Identity();
};

// The projector is a camera that sends light: same model, same direction of the projection.
struct Rig {
  PinholeCamera left, right, projector;
};

enum class Side { kLeft, kRight };

inline const PinholeCamera& CameraOf(const Rig& rig, Side side) {
  return side == Side::kLeft ? rig.left : rig.right;
}

// Pixel of a point with z > 0 in the camera frame.
Eigen::Vector2d Project(const Lens& lens, const Eigen::Vector3d& p_in_camera);

// (x/z, y/z) of the ray through a pixel; to 1e-12 for lenses whose distortion is well below 1 at the border.
Eigen::Vector2d Unproject(const Lens& lens, const Eigen::Vector2d& pixel);

}  // namespace forgescan
