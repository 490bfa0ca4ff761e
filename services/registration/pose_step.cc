#include "services/registration/pose_step.h"

#include <Eigen/Eigenvalues>
#include <cmath>

namespace forgescan {
namespace {

constexpr double kUnknowns = 6;

struct NormalEquations {
  Matrix6 information = Matrix6::Zero();
  Vector6 gradient = Vector6::Zero();
  double weight = 0;
  double squares = 0;
  std::size_t pairs = 0;
};

NormalEquations Accumulate(const std::vector<Pair>& pairs, const StepFrame& frame) {
  NormalEquations sum;
  for (const Pair& pair : pairs) {
    if (!(pair.weight > 0)) continue;
    const Eigen::Vector3d normal = pair.normal.cast<double>();
    const Eigen::Vector3d arm = pair.point.cast<double>() - frame.center;
    Vector6 row;
    row << arm.cross(normal).cwiseQuotient(frame.reach_mm), normal;
    const double weight = pair.weight;
    const double residual_mm = (pair.point - pair.foot).cast<double>().dot(normal);
    sum.information.noalias() += weight * row * row.transpose();
    sum.gradient += weight * residual_mm * row;
    sum.weight += weight;
    sum.squares += weight * residual_mm * residual_mm;
    ++sum.pairs;
  }
  return sum;
}

Eigen::Isometry3d ExactMotion(const Vector6& step, const StepFrame& frame) {
  const Eigen::Vector3d rotation = step.head<3>().cwiseQuotient(frame.reach_mm);
  const double angle = rotation.norm();
  Eigen::Isometry3d motion = Eigen::Isometry3d::Identity();
  if (angle > 0) motion.linear() = Eigen::AngleAxisd(angle, rotation / angle).toRotationMatrix();
  motion.translation() = frame.center + step.tail<3>() - motion.linear() * frame.center;
  return motion;
}

}  // namespace

Result<PoseStep> SolveStep(const std::vector<Pair>& pairs, const StepFrame& frame, const StepGuard& guard) {
  const NormalEquations sum = Accumulate(pairs, frame);
  if (static_cast<double>(sum.pairs) < kUnknowns) {
    return Fail(ErrorCode::kDegenerate, "{} point pairs are left, a pose needs at least 6", sum.pairs);
  }
  const Eigen::SelfAdjointEigenSolver<Matrix6> eigen(sum.information / sum.weight);
  const double weakest = eigen.eigenvalues()[0];
  if (!(weakest >= guard.min_eigenvalue)) {
    return Fail(ErrorCode::kDegenerate,
                "the points do not fix the pose: weakest eigenvalue {:.2g}, at least {:.2g} is needed",
                weakest, guard.min_eigenvalue);
  }
  const Matrix6 inverse = eigen.eigenvectors() *
                          (eigen.eigenvalues().array() + guard.damping).inverse().matrix().asDiagonal() *
                          eigen.eigenvectors().transpose() / sum.weight;
  const Vector6 step = -inverse * sum.gradient;
  PoseStep result;
  result.moved_from_before = ExactMotion(step, frame);
  result.rotation_mm = step.head<3>().norm();
  result.translation_mm = step.tail<3>().norm();
  result.rms_mm = std::sqrt(sum.squares / sum.weight);
  result.weakest_eigenvalue = weakest;
  Vector6 units;
  units << frame.reach_mm.cwiseInverse(), Eigen::Vector3d::Ones();
  const double freedom = std::max(sum.weight - kUnknowns, 1.0);
  result.covariance = sum.squares / freedom * units.asDiagonal() * inverse * units.asDiagonal();
  return result;
}

}  // namespace forgescan
