// Least-squares cone.
#pragma once

#include <cmath>

#include "services/common/features/robust_fit.h"

namespace forgescan {

// Units: mm. Frames: that of the points.
struct ConeFit {
  Eigen::Vector3d axis_point =
      Eigen::Vector3d::Zero();                     // on the axis, beside the centroid of the points used
  Eigen::Vector3d axis = Eigen::Vector3d::Zero();  // unit; the cone widens along it
  double radius_mm = 0;                            // at axis_point
  double half_angle_rad = 0;                       // >= 0
  // Of (axis_point along two directions across the axis, tilt towards them in rad, radius, half angle in
  // rad), as if the points were independent.
  Eigen::Matrix<double, 6, 6> covariance = Eigen::Matrix<double, 6, 6>::Zero();
  FitQuality quality;

  // Distance from the surface, + outside.
  double Residual(const Eigen::Vector3d& p) const {
    const Eigen::Vector3d q = p - axis_point;
    const double along = q.dot(axis);
    return ((q - along * axis).norm() - radius_mm) * std::cos(half_angle_rad) -
           along * std::sin(half_angle_rad);
  }
  double RadiusUncertaintyMm() const { return std::sqrt(covariance(4, 4)); }
  double HalfAngleUncertaintyRad() const { return std::sqrt(covariance(5, 5)); }
};

// The nominal cone, or another that is near.
struct ConeStart {
  Eigen::Vector3d axis_point;
  Eigen::Vector3d axis;
  double radius_mm;       // at axis_point
  double half_angle_rad;  // below a quarter turn; negative where the cone narrows along the axis
};

// Gauss-Newton over the six parameters. Errors: kInvalidArgument (fewer than options.min_points, not finite,
// start not usable); kNotConverged if the points do not fix axis, radius and angle, as on one ring or a short
// arc; kUntrusted: CheckForm() against the radius.
Result<ConeFit> FitCone(std::span<const Eigen::Vector3d> points, const ConeStart& start,
                        const RobustOptions& options);

}  // namespace forgescan
