// Where a calibrated rig sees points, and which points it makes of what it sees.
#pragma once

#include <Eigen/Core>
#include <span>
#include <vector>

#include "services/common/imaging/stereo_calibration.h"

namespace forgescan {

// Raw pixels of the same points in both cameras. Shape: equal lengths.
struct PixelPairs {
  std::vector<Eigen::Vector2d> left, right;
};

// Frames: camera = the rectified left camera of this calibration, as the reconstruction's clouds are (R1 of
// cv::stereoRectify). Units: mm, px.
class RigGeometry {
 public:
  // The calibration has passed Check(), and its baseline runs along the rows.
  explicit RigGeometry(const StereoCalibration& calibration);

  PixelPairs Seen(std::span<const Eigen::Vector3d> p_in_camera) const;

  // x and z by the disparity. The two rays miss each other by a little in y, and a measurement with fringes
  // across the rows does not see it: partners are sought on epipolar lines, by the projector's columns.
  // What is found of a surface lies at y of the left ray and the right one in shares of left_share().
  std::vector<Eigen::Vector3d> Triangulated(const PixelPairs& pixels) const;

  // Where the projector stands between the cameras along the baseline: 0 at the left one, whose image then
  // shows no relief, 1 at the right one. 0.5 if the projector is not calibrated.
  double left_share() const { return left_share_; }

  std::vector<Eigen::Vector3d> LeftFromCamera(std::span<const Eigen::Vector3d> p_in_camera) const;
  Eigen::Vector3d CameraFromLeft(const Eigen::Vector3d& p_in_left) const {
    return rectified_from_left_ * p_in_left;
  }

 private:
  StereoCalibration calibration_;
  Eigen::Matrix3d rectified_from_left_, rectified_from_right_;
  double baseline_mm_ = 0;
  double left_share_ = 0.5;
};

}  // namespace forgescan
