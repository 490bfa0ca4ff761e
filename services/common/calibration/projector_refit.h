// The projector follows its cameras.
#pragma once

#include <span>

#include "services/common/calibration/rig_parameters.h"

namespace forgescan {

struct ProjectorRefit {
  ProjectorCalibration projector;
  double rms_before_px = 0;  // of the columns of the same points, present projector with refined points
  double rms_px = 0;         // left
};

// Purpose: a projector is calibrated by the columns that calibrated cameras see at the points they measure;
// when a refined calibration moves the points, the old projector contradicts them. Method: each point keeps
// the projector pixel that the present calibration gives it; pose, focal lengths and centre of the projector
// are fitted to the moved points by least squares, with `prior` as their standard deviations about the
// present ones and 0.02 px for a pixel. present must have a projector. p_in_camera: points over the measuring
// volume, frame of the present calibration. Errors: kNotConverged.
Result<ProjectorRefit> RefitProjector(const StereoCalibration& present, const StereoCalibration& refined,
                                      std::span<const Eigen::Vector3d> p_in_camera,
                                      const CalibrationPrior& prior);

}  // namespace forgescan
