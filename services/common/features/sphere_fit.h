// Least-squares sphere.
#pragma once

#include "services/common/features/robust_fit.h"

namespace forgescan {

// Units: mm. Frames: that of the points.
struct SphereFit {
  static constexpr double kUnknowns = 4;
  Eigen::Vector3d center = Eigen::Vector3d::Zero();
  double radius_mm = 0;
  Eigen::Matrix4d covariance =
      Eigen::Matrix4d::Zero();  // of (center, radius), mm^2, as if the points were independent
  FitQuality quality;

  double Residual(const Eigen::Vector3d& p) const { return (p - center).norm() - radius_mm; }
};

// Errors: kInvalidArgument (fewer than options.min_points, not finite); kDegenerate if the points do not fix
// a sphere (a plane, a cap too flat for its scatter: CheckSagitta()); kUntrusted: CheckForm(); kNotConverged.
Result<SphereFit> FitSphere(std::span<const Eigen::Vector3d> points, const RobustOptions& options);

}  // namespace forgescan
