// Least-squares cylinder.
#pragma once

#include <algorithm>
#include <cmath>
#include <optional>

#include "services/common/features/robust_fit.h"

namespace forgescan {

// Units: mm. Frames: that of the points.
struct CylinderFit {
  static constexpr double kUnknowns = 5;
  Eigen::Vector3d axis_point =
      Eigen::Vector3d::Zero();                     // on the axis, beside the centroid of the points used
  Eigen::Vector3d axis = Eigen::Vector3d::Zero();  // unit; sign: the largest component is positive
  double radius_mm = 0;
  double arc_deg = 0;  // 360 less the largest gap in the points used, seen along the axis; strays
                       // do not fill a gap
  bool radius_constrained = false;  // the radius was given, not fitted
  bool axis_constrained = false;    // the axis was given, not fitted
  // Of (axis_point along two directions across the axis, tilt towards them in rad, radius), as if the points
  // were independent. What is constrained has variance 0.
  Eigen::Matrix<double, 5, 5> covariance = Eigen::Matrix<double, 5, 5>::Zero();
  FitQuality quality;

  double Residual(const Eigen::Vector3d& p) const {
    const Eigen::Vector3d q = p - axis_point;
    return (q - q.dot(axis) * axis).norm() - radius_mm;
  }
  double RadiusUncertaintyMm() const { return std::sqrt(covariance(4, 4)); }
  // Standard uncertainty of the axis' direction, its larger one.
  double AxisUncertaintyRad() const { return std::sqrt(std::max(covariance(2, 2), covariance(3, 3))); }
};

struct CylinderStart {
  Eigen::Vector3d axis_point;
  Eigen::Vector3d axis;
  double radius_mm;
  bool keep_radius = false;  // fit position and direction only
  bool keep_axis = false;    // fit the radius only
};

// Gauss-Newton over the five parameters. Without a start, directions all over the half sphere are tried on a
// sample of the points, each with an algebraic circle. Errors: kInvalidArgument (fewer than
// options.min_points, not finite, start not usable); kDegenerate if the points do not fix the axis or the
// radius (an arc too short, or too flat for its scatter: CheckSagitta(); a ring so low that its scatter turns
// the axis by more than 0.3 degrees); kUntrusted: CheckForm(); kNotConverged.
Result<CylinderFit> FitCylinder(std::span<const Eigen::Vector3d> points,
                                const std::optional<CylinderStart>& start, const RobustOptions& options);

}  // namespace forgescan
