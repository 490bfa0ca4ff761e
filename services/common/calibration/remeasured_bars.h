// What another calibration would have made of a bar that was measured once.
#pragma once

#include <Eigen/Core>
#include <span>
#include <vector>

#include "services/common/calibration/ball_bar.h"
#include "services/common/calibration/rig_geometry.h"

namespace forgescan {

class RemeasuredBars {
 public:
  // present: the calibration the centres were measured with. Its rig sees of each ball the part of the
  // surface within 60 degrees of the direction to the camera; with radius 0 the centre alone.
  RemeasuredBars(const StereoCalibration& present, std::span<const BarPlacement> placements,
                 double ball_radius_mm);

  // Distances of the centres, fitted with the known radius to the surface as this calibration measures it,
  // to first order in how it moved. Shape: one a placement, in their order. Units: mm.
  Eigen::VectorXd DistancesBy(const StereoCalibration& calibration) const;

 private:
  std::vector<Eigen::Vector3d> centers_;   // two a placement
  std::vector<Eigen::Vector3d> outwards_;  // the same number of them for every ball, unit length
  std::vector<Eigen::Vector3d> points_;    // centre + radius * outward
  PixelPairs pixels_;                      // of the points
};

}  // namespace forgescan
