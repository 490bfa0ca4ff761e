#include "services/common/calibration/rig_parameters.h"

#include <Eigen/Geometry>
#include <cmath>

namespace forgescan {
namespace {

void Correct(CameraIntrinsics& camera, const Eigen::Matrix<double, 5, 1>& correction) {
  camera.camera_matrix(0, 0) += correction(0);
  camera.camera_matrix(1, 1) += correction(1);
  camera.camera_matrix(0, 2) += correction(2);
  camera.camera_matrix(1, 2) += correction(3);
  camera.distortion.at(0) += correction(4);
}

}  // namespace

const std::array<RigParameter, kRigParameters>& RigParameters() {
  static constexpr std::array<RigParameter, kRigParameters> kParameters = {{{"left fx", "px"},
                                                                            {"left fy", "px"},
                                                                            {"left cx", "px"},
                                                                            {"left cy", "px"},
                                                                            {"left k1", ""},
                                                                            {"right fx", "px"},
                                                                            {"right fy", "px"},
                                                                            {"right cx", "px"},
                                                                            {"right cy", "px"},
                                                                            {"right k1", ""},
                                                                            {"rotation x", "rad"},
                                                                            {"rotation y", "rad"},
                                                                            {"rotation z", "rad"},
                                                                            {"translation x", "mm"},
                                                                            {"translation y", "mm"},
                                                                            {"translation z", "mm"}}};
  return kParameters;
}

RigVector CalibrationPrior::StandardDeviations() const {
  RigVector sd;
  sd << focal_px, focal_px, center_px, center_px, k1, focal_px, focal_px, center_px, center_px, k1,
      Eigen::Vector3d::Constant(rotation_rad), Eigen::Vector3d::Constant(translation_mm);
  return sd;
}

Status Check(const CalibrationPrior& prior) {
  const RigVector sd = prior.StandardDeviations();
  for (int i = 0; i < kRigParameters; ++i) {
    if (!(std::isfinite(sd(i)) && sd(i) >= 0)) {
      return Fail(ErrorCode::kInvalidArgument, "the prior standard deviation of {} is {}, allowed 0 and up",
                  RigParameters().at(static_cast<std::size_t>(i)).name, sd(i));
    }
  }
  if (sd.isZero(0)) {
    return Fail(ErrorCode::kInvalidArgument,
                "all prior standard deviations are 0: there is nothing that may be refined");
  }
  return {};
}

Eigen::Matrix3d RotationBy(const Eigen::Vector3d& turn) {
  const double angle = turn.norm();
  const Eigen::Vector3d axis = angle > 0 ? Eigen::Vector3d(turn / angle) : Eigen::Vector3d::UnitX();
  return Eigen::AngleAxisd(angle, axis).toRotationMatrix();
}

StereoCalibration Corrected(StereoCalibration calibration, const RigVector& correction) {
  Correct(calibration.left, correction.head<5>());
  Correct(calibration.right, correction.segment<5>(5));
  PoseFromLeft& pose = calibration.right_from_left;
  pose.rotation = RotationBy(correction.segment<3>(10)) * pose.rotation;
  pose.translation_mm += correction.tail<3>();
  return calibration;
}

}  // namespace forgescan
