// The robot does not come back to a view exactly. What stands still about the part (rests, rails, blocks put
// there for it) tells by how much: the same view saw it when the station was set up, by the same pixels, so
// the errors of calibration and view matrix are in both clouds and drop out of their difference.
#pragma once

#include <Eigen/Geometry>
#include <cstddef>
#include <span>

#include "services/common/result.h"
#include "services/fusion/surface_cells.h"

namespace forgescan {

using Vector6 = Eigen::Matrix<double, 6, 1>;

struct VisitErrorOptions {
  SurfaceCellOptions cells;  // of both clouds
  // Standard deviations of the robot's error, each axis, about the view's middle: to be given, above 0.
  double robot_shift_mm = 0, robot_turn_rad = 0;
  double max_distance_mm = 0.15;  // farther than that is another surface
  double hidden_mm = 10;          // so far before it, and it is hidden, by the part: that tells nothing
  double min_cos_normals = 0.97;  // 14 degrees
  double patch_rad = 0.03;        // errors within such a piece, 20 mm at 650 mm, go together,
  double patch_mm = 0.0005;       // with this standard deviation
  double max_sigmas = 6;          // an error beyond so many of the robot's is none of the robot's
  double max_patch_sigmas = 6;    // a piece farther off the rest than this
  double max_patch_mm = 0.005;    // and than this has moved by itself
  std::size_t min_cells = 0;      // of both clouds in one place: with fewer nothing is said
};

struct VisitError {
  Eigen::Isometry3d taught_from_actual = Eigen::Isometry3d::Identity();  // camera frame, mm
  double shift_mm = 0;                                                   // of the middle of the cloud
  // Of shift along (mm) and turn about (rad) the axes; the robot's own where nothing that stands still tells.
  Vector6 standard = Vector6::Zero();
  std::size_t cells = 0;  // that both clouds have
};

// Purpose: how far the camera is from where it stood when `standing` was seen. Method: least squares of
// distances along the mean normal of two cells, weighted by patches, Huber's weights beyond 3 sigma; the
// robot's repeatability is the prior, so a motion that nothing shows stays zero. Frames: both of the camera.
// Deterministic. Errors: kUntrusted if most of what stood still has moved, or the error is too large for the
// robot: a knock, or the surroundings were moved; or a piece of what stood still is where the rest of it is
// not. Cells without a finite variance above 0 do not count. Cost: the sort of SurfaceCells.
Result<VisitError> EstimateVisitError(std::span<const SurfaceCell> standing,
                                      const PointCloud& cloud_in_camera, const VisitErrorOptions& options);

}  // namespace forgescan
