// Decoded views of a scene of known shape, without images: truth for stereo alone.
#pragma once

#include <Eigen/Core>
#include <functional>

#include "services/common/imaging/stereo_calibration.h"
#include "services/reconstruction/decoded_view.h"

namespace forgescan {

struct DecodedScene {
  // Where a ray of the raw left camera's frame first meets the scene, in lengths of `direction`; not above 0:
  // nowhere.
  std::function<double(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction)> hit;
  std::function<bool(const Eigen::Vector3d& p_in_left)> is_hole = [](const Eigen::Vector3d&) {
    return false;
  };
  double projector_width_px = 0;
  double noise_px = 0;  // normal, of each coordinate; what variance_px2 says of it
  // Coordinates of masked pixels stay, 0 where there is no light, and there is no border.
  bool keeps_masked = false;
};

// What a camera sees of it. pose: of the camera. Masked: shadows of the projector and holes, with a border of
// 2 px as the decoder leaves it. seed: of the noise. rig: with image size and projector.
DecodedView SeeDecoded(const DecodedScene& scene, const CameraIntrinsics& lens, const PoseFromLeft& pose,
                       const StereoCalibration& rig, unsigned seed);

// Turns raw left camera coordinates into those of the rectified left camera.
Eigen::Matrix3d RectifiedFromLeft(const StereoCalibration& rig);

}  // namespace forgescan
