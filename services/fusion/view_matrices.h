// The taught view matrices (paper 2.1.3): where the scanner's points of each view lie in the points' array of
// the markers.
#pragma once

#include <Eigen/Geometry>
#include <cstdint>
#include <string>
#include <vector>

#include "services/common/result.h"

namespace forgescan {

struct ViewMatrices {
  std::uint32_t path_crc32 = 0;     // of the robot path they were taught on
  double recorded_body_degc = 0.0;  // temperature of the robot's body then
  // One a view. Frames: camera = rectified left camera, array = points' array. Units: mm.
  std::vector<Eigen::Isometry3d> array_from_camera;

  // views.toml: path_crc32, recorded_body_degc, and for each view [[view]] index, array_from_camera (16
  // numbers, row-major). Errors: as ConfigFile, and kInvalidArgument for a matrix that is not rigid or an
  // index out of order.
  static Result<ViewMatrices> Load(const std::string& path);
};

}  // namespace forgescan
