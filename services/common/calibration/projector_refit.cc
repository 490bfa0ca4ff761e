#include "services/common/calibration/projector_refit.h"

#include <Eigen/Cholesky>

#include "services/common/calibration/lens_rays.h"
#include "services/common/calibration/rig_geometry.h"

namespace forgescan {
namespace {

constexpr int kUnknowns = 10;  // fx fy cx cy, rotation, translation
constexpr double kPixelSigma = 0.02;
using Unknowns = Eigen::Matrix<double, kUnknowns, 1>;

ProjectorCalibration Moved(ProjectorCalibration projector, const Unknowns& by) {
  Eigen::Matrix3d& matrix = projector.intrinsics.camera_matrix;
  matrix(0, 0) += by(0);
  matrix(1, 1) += by(1);
  matrix(0, 2) += by(2);
  matrix(1, 2) += by(3);
  PoseFromLeft& pose = projector.projector_from_left;
  pose.rotation = RotationBy(by.segment<3>(4)) * pose.rotation;
  pose.translation_mm += by.tail<3>();
  return projector;
}

// x and y of all points one after the other, px.
Eigen::VectorXd Pixels(const ProjectorCalibration& projector, std::span<const Eigen::Vector3d> p_in_left) {
  std::vector<Eigen::Vector3d> p_in_projector;
  const PoseFromLeft& pose = projector.projector_from_left;
  for (const Eigen::Vector3d& p : p_in_left)
    p_in_projector.emplace_back(pose.rotation * p + pose.translation_mm);
  const std::vector<Eigen::Vector2d> pixels = ProjectPoints(projector.intrinsics, p_in_projector);
  Eigen::VectorXd result(2 * std::ssize(pixels));
  for (Eigen::Index i = 0; i < std::ssize(pixels); ++i) {
    result.segment<2>(2 * i) = pixels[static_cast<std::size_t>(i)];
  }
  return result;
}

double ColumnRms(const Eigen::VectorXd& residuals) {
  const auto count = residuals.size() / 2;
  double sum = 0;
  for (Eigen::Index i = 0; i < count; ++i) sum += residuals(2 * i) * residuals(2 * i);
  return std::sqrt(sum / static_cast<double>(count));
}

}  // namespace

Result<ProjectorRefit> RefitProjector(const StereoCalibration& present, const StereoCalibration& refined,
                                      std::span<const Eigen::Vector3d> p_in_camera,
                                      const CalibrationPrior& prior) {
  const RigGeometry before(present), after(refined);
  const Eigen::VectorXd wanted = Pixels(*present.projector, before.LeftFromCamera(p_in_camera));
  const std::vector<Eigen::Vector3d> moved =
      after.LeftFromCamera(after.Triangulated(before.Seen(p_in_camera)));
  Unknowns sd;
  sd << prior.focal_px, prior.focal_px, prior.center_px, prior.center_px,
      Eigen::Vector3d::Constant(prior.rotation_rad), Eigen::Vector3d::Constant(prior.translation_mm);
  Unknowns x = Unknowns::Zero();  // in units of sd
  constexpr int kSteps = 5;
  for (int step = 0; step < kSteps; ++step) {
    const ProjectorCalibration now = Moved(*present.projector, sd.cwiseProduct(x));
    const Eigen::VectorXd residuals = (Pixels(now, moved) - wanted) / kPixelSigma;
    Eigen::MatrixXd jacobian(residuals.size(), kUnknowns);
    for (int i = 0; i < kUnknowns; ++i) {
      const Unknowns up = x + 0.5 * Unknowns::Unit(i), down = x - 0.5 * Unknowns::Unit(i);
      jacobian.col(i) = (Pixels(Moved(*present.projector, sd.cwiseProduct(up)), moved) -
                         Pixels(Moved(*present.projector, sd.cwiseProduct(down)), moved)) /
                        kPixelSigma;
    }
    const Eigen::MatrixXd matrix =
        jacobian.transpose() * jacobian + Eigen::MatrixXd::Identity(kUnknowns, kUnknowns);
    x = matrix.ldlt().solve(jacobian.transpose() * (jacobian * x - residuals));
  }
  if (!x.allFinite()) {
    return Fail(ErrorCode::kNotConverged, "the projector could not be fitted to the refined points");
  }
  ProjectorRefit refit{Moved(*present.projector, sd.cwiseProduct(x)), 0, 0};
  refit.rms_before_px = ColumnRms(Pixels(*present.projector, moved) - wanted);
  refit.rms_px = ColumnRms(Pixels(refit.projector, moved) - wanted);
  return refit;
}

}  // namespace forgescan
