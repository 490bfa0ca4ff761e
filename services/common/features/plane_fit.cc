#include "services/common/features/plane_fit.h"

#include <Eigen/Eigenvalues>

namespace forgescan {
namespace {

constexpr double kFlatShare =
    1e-6;  // second spread against the first (variances): below, the points are a line

Result<PlaneFit> FitOnce(std::span<const Eigen::Vector3d> points) {
  PlaneFit plane;
  for (const Eigen::Vector3d& p : points) plane.point += p;
  plane.point /= static_cast<double>(points.size());
  Eigen::Matrix3d scatter = Eigen::Matrix3d::Zero();
  for (const Eigen::Vector3d& p : points) scatter += (p - plane.point) * (p - plane.point).transpose();
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> eigen(scatter);
  const Eigen::Vector3d spread = eigen.eigenvalues();
  if (!(spread[1] > kFlatShare * spread[2])) {
    return Fail(ErrorCode::kDegenerate, "{} points lie on a line, a plane needs spread in two directions",
                points.size());
  }
  plane.spread_mm = std::sqrt(spread[1] / static_cast<double>(points.size()));
  plane.normal = eigen.eigenvectors().col(0);
  Eigen::Index largest = 0;
  plane.normal.cwiseAbs().maxCoeff(&largest);
  if (plane.normal[largest] < 0) plane.normal = -plane.normal;
  for (int i = 1; i < 3; ++i) {
    plane.covariance += eigen.eigenvectors().col(i) * eigen.eigenvectors().col(i).transpose() / spread[i];
  }
  return plane;
}

}  // namespace

double PlaneFit::OffsetUncertaintyMm(const Eigen::Vector3d& at) const {
  const Eigen::Vector3d arm = at - point;
  const double variance =
      1.0 / static_cast<double>(std::max<std::size_t>(quality.used(), 1)) + arm.dot(covariance * arm);
  return quality.sigma_mm * std::sqrt(variance);
}

Result<PlaneFit> FitPlane(std::span<const Eigen::Vector3d> points, const RobustOptions& options) {
  constexpr std::size_t kUnknowns = 3;
  RETURN_IF_ERROR(CheckPoints(points, std::max(kUnknowns, options.min_points), "plane"));
  const auto fit = [](const std::vector<Eigen::Vector3d>& used, const PlaneFit*) {
    return used.size() < kUnknowns
               ? Result<PlaneFit>(Fail(ErrorCode::kDegenerate, "fewer than 3 points are left for a plane"))
               : FitOnce(used);
  };
  ASSIGN_OR_RETURN(PlaneFit plane, FitRobust<PlaneFit>(points, options, fit));
  RETURN_IF_ERROR(CheckForm(plane.quality, plane.spread_mm, options, "plane"));
  return plane;
}

}  // namespace forgescan
