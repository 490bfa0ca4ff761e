// The commissioning of the virtual station: a calibration that is slightly wrong, and views taught with it.
//
// The view matrices come from simulated markers seen by the true rig and triangulated with the written
// calibration, so they absorb the calibration's errors as real ones do.
#pragma once

#include <vector>

#include "services/common/imaging/stereo_calibration.h"
#include "tools/virtual_station/cell_config.h"

namespace forgescan {

// The true rig plus seeded errors. Frame: its "rig" is the true rig's.
Rig CalibratedRig(const CellConfig& config);

// A rig as its calibration file says it, and back: the left camera stays where `rig` has it.
StereoCalibration CalibrationOf(const Rig& rig);
Rig WithCalibration(Rig rig, const StereoCalibration& calibration);

// Rectification of a rig as cv::stereoRectify defines it (zero disparity at infinity, default alpha).
// Frames: rectified = camera frame of P1. Units: mm.
struct Rectification {
  Eigen::Matrix3d rectified_from_left, rectified_from_right;  // R1, R2
  double baseline_mm;
};
Rectification Rectify(const Rig& rig);

// For every view: array_from_camera, camera = the rectified left camera of `calibrated`.
std::vector<Eigen::Isometry3d> TeachViews(const CellConfig& config, const Rig& calibrated);

}  // namespace forgescan
