// A stereo calibration prepared for one image size: epipolar lines and the numbers triangulation needs.
#pragma once

#include <Eigen/Core>
#include <optional>

#include "services/common/imaging/stereo_calibration.h"
#include "services/common/result.h"
#include "services/reconstruction/epipolar_table.h"

namespace forgescan {

// Frames: `camera` is the rectified left camera: origin in the left camera's centre, x along the baseline, as
// cv::stereoRectify gives it (P1) with CALIB_ZERO_DISPARITY, alpha -1 and the image size of the raw frames.
// mm.
struct StereoRig {
  EpipolarTable left_lines;
  EpipolarTable right_lines;
  double focal_px = 0;
  double left_center_x_px = 0;
  double right_center_x_px = 0;
  double center_y_px = 0;
  double baseline_mm = 0;  // left to right along x; negative when the right camera stands on the left
  std::optional<ProjectorCalibration> projector;  // its pose from the rectified left camera

  ImageSize size() const { return left_lines.size(); }
};

// Errors: those of Check(calibration); kInvalidArgument when the image size is not the calibration's or
// cannot be (principal point outside the middle half of the frame, field of view outside 2 to 120 degrees,
// focal lengths that differ by more than 15 %), when a lens folds the image over or shifts its corners by
// more than 30 % of their radius, or when the cameras stand above each other (rows would not be epipolar
// lines). Cost: about 0.3 s at 5 MP; do it once.
Result<StereoRig> MakeStereoRig(const StereoCalibration& calibration, ImageSize image_size);

}  // namespace forgescan
