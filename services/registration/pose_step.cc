#include "services/registration/pose_step.h"

#include <cmath>

#include "services/common/geometry/dense_solvers.h"
#include "services/common/parallel_blocks.h"

namespace forgescan {
namespace {

constexpr double kUnknowns = 6;
constexpr std::size_t kBlock = 1024;    // pairs summed in one go
constexpr double kAlongAnAxis = 0.995;  // cosine above which a direction is called by the axis' name

struct NormalEquations {
  Matrix6 information = Matrix6::Zero();
  Vector6 gradient = Vector6::Zero();
  double weight = 0;
  double squares = 0;
  std::size_t pairs = 0;
};

void Add(const Pair& pair, const StepFrame& frame, NormalEquations& sum) {
  const Eigen::Vector3d normal = pair.normal.cast<double>();
  const Eigen::Vector3d arm = pair.point.cast<double>() - frame.center;
  Vector6 row;
  row << arm.cross(normal).cwiseQuotient(frame.reach_mm), normal;
  const double weight = pair.weight;
  const double residual_mm = (pair.point - pair.foot).cast<double>().dot(normal);
  sum.information.noalias() += (weight * row) * row.transpose();
  sum.gradient += weight * residual_mm * row;
  sum.weight += weight;
  sum.squares += weight * residual_mm * residual_mm;
  ++sum.pairs;
}

NormalEquations Accumulate(const std::vector<Pair>& pairs, const StepFrame& frame, unsigned threads) {
  std::vector<NormalEquations> blocks(BlockCount(pairs.size(), kBlock));
  ForEachBlock(pairs.size(), kBlock, threads, [&](std::size_t block, std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      if (pairs[i].weight > 0) Add(pairs[i], frame, blocks[block]);
    }
  });
  NormalEquations sum;
  for (const NormalEquations& block : blocks) {
    sum.information += block.information;
    sum.gradient += block.gradient;
    sum.weight += block.weight;
    sum.squares += block.squares;
    sum.pairs += block.pairs;
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

std::string NameOfDirection(const Eigen::Vector3d& direction) {
  for (int axis = 0; axis < 3; ++axis) {
    if (std::abs(direction[axis]) >= kAlongAnAxis) return std::string(1, static_cast<char>('x' + axis));
  }
  return fmt::format("({:.2f}, {:.2f}, {:.2f})", direction.x(), direction.y(), direction.z());
}

}  // namespace

std::string NameOfMotion(const Vector6& motion, const StepFrame& frame) {
  if (motion.tail<3>().norm() >= motion.head<3>().norm()) {
    return "translation along " + NameOfDirection(motion.tail<3>().normalized());
  }
  return "rotation about " + NameOfDirection(motion.head<3>().cwiseQuotient(frame.reach_mm).normalized());
}

Result<PoseStep> SolveStep(const std::vector<Pair>& pairs, const StepFrame& frame, const StepGuard& guard) {
  const NormalEquations sum = Accumulate(pairs, frame, guard.threads);
  if (static_cast<double>(sum.pairs) < kUnknowns) {
    return Fail(ErrorCode::kDegenerate, "{} point pairs are left, a pose needs at least 6", sum.pairs);
  }
  const auto [eigenvalues, motions] = EigensystemOf(sum.information / sum.weight);
  const double weakest = eigenvalues[0];
  if (!(weakest >= guard.min_eigenvalue)) {
    return Fail(
        ErrorCode::kDegenerate,
        "the points do not fix the pose: {} is held with an eigenvalue of {:.2g}, at least {:.2g} is needed",
        NameOfMotion(motions.col(0), frame), weakest, guard.min_eigenvalue);
  }
  const Matrix6 inverse = motions * (eigenvalues.array() + guard.damping).inverse().matrix().asDiagonal() *
                          motions.transpose() / sum.weight;
  const Vector6 step = -inverse * sum.gradient;
  PoseStep result;
  result.moved_from_before = ExactMotion(step, frame);
  result.rotation_mm = step.head<3>().norm();
  result.translation_mm = step.tail<3>().norm();
  result.rms_mm = std::sqrt(sum.squares / sum.weight);
  for (int i = 0; i < 6; ++i) {
    result.motions[static_cast<std::size_t>(i)] = {motions.col(i), eigenvalues[i]};
  }
  Vector6 units;
  units << frame.reach_mm.cwiseInverse(), Eigen::Vector3d::Ones();
  const double freedom = std::max(sum.weight - kUnknowns, 1.0);
  result.covariance = sum.squares / freedom * units.asDiagonal() * inverse * units.asDiagonal();
  return result;
}

}  // namespace forgescan
