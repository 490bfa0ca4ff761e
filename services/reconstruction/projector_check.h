// Whether the projector could have lit points by the columns they show.
#pragma once

#include "services/common/imaging/stereo_calibration.h"
#include "services/reconstruction/histogram_median.h"
#include "services/reconstruction/reconstruction_config.h"
#include "services/reconstruction/stereo/kernel.h"

namespace forgescan {

constexpr double kMaxResidualPx = 64;  // larger ones count as this in a median

class ProjectorCheck {
 public:
  // projector: its pose from the rectified left camera.
  ProjectorCheck(const ProjectorCalibration& projector, const ReconstructionConfig& config);

  // Takes the points out of the row that are off by more than the limit, notes the residuals of all (shown
  // column minus the projected one, px), and returns how many went.
  int Filter(PointRow& row, HistogramMedian& residuals_px) const;

 private:
  struct Image {
    float x, y;
  };
  float ColumnOf(const float* p_in_camera) const;
  Image Distorted(float x, float y) const;

  float rotation_[9], translation_mm_[3];
  float focal_px_, center_px_;
  float distortion_[14];
  float tilt_[9];  // of the sensor
  float max_residual_px_, max_residual_sigma_;
};

}  // namespace forgescan
