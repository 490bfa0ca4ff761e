// Least-squares plane.
#pragma once

#include "services/common/features/robust_fit.h"

namespace forgescan {

// Units: mm. Frames: that of the points.
struct PlaneFit {
  static constexpr double kUnknowns = 3;
  Eigen::Vector3d point = Eigen::Vector3d::Zero();   // centroid of the points used
  Eigen::Vector3d normal = Eigen::Vector3d::Zero();  // unit; sign: the largest component is positive
  Eigen::Matrix3d covariance =
      Eigen::Matrix3d::Zero();  // of the normal, divided by sigma^2; see OffsetUncertaintyMm
  double spread_mm = 0;  // standard deviation of the points used along their narrower direction in the plane
  FitQuality quality;

  double Residual(const Eigen::Vector3d& p) const { return normal.dot(p - point); }
  double offset_mm() const { return normal.dot(point); }
  // Standard uncertainty of the plane's height over `at`, from the scatter of the points as if independent.
  double OffsetUncertaintyMm(const Eigen::Vector3d& at) const;
};

// Errors: kInvalidArgument (fewer than options.min_points, not finite); kDegenerate if the points lie on a
// line or in one place; kUntrusted if they are not flat: see CheckForm().
Result<PlaneFit> FitPlane(std::span<const Eigen::Vector3d> points, const RobustOptions& options);

}  // namespace forgescan
