// What a stereo calibration may be wrong by: 16 numbers, and how well its report knows them.
#pragma once

#include <Eigen/Core>
#include <array>

#include "services/common/imaging/stereo_calibration.h"
#include "services/common/result.h"

namespace forgescan {

inline constexpr int kRigParameters = 16;
using RigVector = Eigen::Matrix<double, kRigParameters, 1>;
using RigMatrix = Eigen::Matrix<double, kRigParameters, kRigParameters>;

struct RigParameter {
  const char* name;
  const char* unit;
};
// In the order of RigVector: fx fy cx cy k1 of the left camera and of the right one, then rotation (about the
// right camera's axes) and translation of right_from_left.
const std::array<RigParameter, kRigParameters>& RigParameters();

// Standard deviations of a calibration's parameters. The defaults are what the calibration report of a 5 MP
// pair with 20 to 30 poses of a board states, rounded up: 0.3 px, 2e-4 of k1, 20 urad, 0.01 mm. Take your
// own report's. 0 holds a parameter.
struct CalibrationPrior {
  double focal_px = 0.3;
  double center_px = 0.3;
  double k1 = 0.0002;
  double rotation_rad = 0.00002;
  double translation_mm = 0.01;

  RigVector StandardDeviations() const;
};

// Errors: kInvalidArgument for a number that is negative or not finite, or for nothing but zeros.
Status Check(const CalibrationPrior& prior);

// Units: those of RigParameters(). The projector stays.
StereoCalibration Corrected(StereoCalibration calibration, const RigVector& correction);

// The rotation about `turn` by its length, rad.
Eigen::Matrix3d RotationBy(const Eigen::Vector3d& turn);

}  // namespace forgescan
