// The smallest ball about points and the smallest cone about directions: how far repeated measurements of one
// place, or of one direction, lie apart.
#pragma once

#include <Eigen/Core>
#include <span>

#include "services/common/result.h"

namespace forgescan {

// Units: those of the points. Frames: that of the points.
struct EnclosingBall {
  Eigen::Vector3d center = Eigen::Vector3d::Zero();
  double radius = 0;
};

// Purpose: the ball of least radius that holds all points; there is exactly one. Source: Welzl, Smallest
// enclosing disks, balls and ellipsoids (1991). Shape: any number of points >= 1, equal ones too. The radius
// is that of the farthest point from the centre, so that the ball holds every point it was made of; its
// rounding is that of the points' spread, not of their distance from the origin. Cost: linear in the number
// of points on average. Errors: kInvalidArgument for no points, or a coordinate that is not finite.
Result<EnclosingBall> MinimumEnclosingBall(std::span<const Eigen::Vector3d> points);

struct DirectionCone {
  Eigen::Vector3d axis = Eigen::Vector3d::Zero();  // unit
  double half_angle_rad = 0;

  double FullAngleRad() const { return 2 * half_angle_rad; }
};

// Purpose: the narrowest cone about the origin that holds all directions. Shape: any number >= 1 of vectors
// of any length > 0. Computed in the plane across the axis, where an angle of 1e-4 rad keeps 12 digits.
// Errors: kInvalidArgument for no directions, or one that is zero or not finite; kDegenerate when no cone
// with a half angle below 80 degrees holds them.
Result<DirectionCone> MinimumCone(std::span<const Eigen::Vector3d> directions);

}  // namespace forgescan
