// Points and pixels of one camera by OpenCV's lens model.
#pragma once

#include <Eigen/Core>
#include <span>
#include <vector>

#include "services/common/imaging/stereo_calibration.h"

namespace forgescan {

// Raw pixels of points in front of the camera. Frames: that camera's. Units: mm, px.
std::vector<Eigen::Vector2d> ProjectPoints(const CameraIntrinsics& camera,
                                           std::span<const Eigen::Vector3d> p_in_camera);

// Directions with z = 1 of the rays through raw pixels, to 1e-12 for lenses of the kind MakeStereoRig admits.
std::vector<Eigen::Vector3d> PixelRays(const CameraIntrinsics& camera,
                                       std::span<const Eigen::Vector2d> pixels);

}  // namespace forgescan
