// What a stereo calibration says about two cameras and, optionally, the projector.
#pragma once

#include <Eigen/Core>
#include <filesystem>
#include <optional>
#include <vector>

#include "services/common/result.h"

namespace forgescan {

// Pinhole camera with OpenCV's lens model. Units: px. distortion: k1 k2 p1 p2 [k3 [k4 k5 k6 [s1..s4 [tx
// ty]]]].
struct CameraIntrinsics {
  Eigen::Matrix3d camera_matrix = Eigen::Matrix3d::Identity();
  std::vector<double> distortion;
};

// p_in_target = rotation * p_in_left + translation_mm.
struct PoseFromLeft {
  Eigen::Matrix3d rotation = Eigen::Matrix3d::Identity();
  Eigen::Vector3d translation_mm = Eigen::Vector3d::Zero();
};

struct ImageSize {
  int width_px = 0;
  int height_px = 0;
};

struct ProjectorCalibration {
  CameraIntrinsics intrinsics;
  PoseFromLeft projector_from_left;
};

struct StereoCalibration {
  CameraIntrinsics left;
  CameraIntrinsics right;
  PoseFromLeft right_from_left;
  std::optional<ImageSize> image_size;  // not all files say for which image size they hold
  std::optional<ProjectorCalibration> projector;
};

// Frames: left and right are the raw cameras, before rectification. Errors: kInvalidArgument for numbers that
// are not finite, a focal length <= 0, focal lengths of a camera that differ by more than 0.5 %, a camera
// matrix with skew or a last row other than 0 0 1, a rotation that is not orthonormal to 1e-6 or a mirror, a
// baseline of 0.
Status Check(const StereoCalibration& calibration);

// Reads an OpenCV file storage (YAML, XML, JSON): Kl Dl Kr Dr R T in mm with x_right = R x_left + T;
// optionally image_width and image_height; optionally Kp Dp Rp Tp with x_projector = Rp x_left + Tp. Errors:
// kNotFound, kFormat (which entry is missing or has a wrong shape), and those of Check().
Result<StereoCalibration> LoadStereoCalibration(const std::filesystem::path& path);

}  // namespace forgescan
