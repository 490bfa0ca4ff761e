// Whether placements of a ball bar can tell anything about a calibration.
#pragma once

#include <span>

#include "services/common/calibration/ball_bar.h"
#include "services/common/imaging/stereo_calibration.h"
#include "services/common/result.h"

namespace forgescan {

struct PlacementRules {
  Eigen::Vector3d volume_mm =
      Eigen::Vector3d::Zero();     // sides of the measuring volume, along the camera's x, y, z
  std::size_t min_placements = 8;  // one more than the seven of VDI/VDE 2634 part 2, so that each has a check
  double min_extent = 0.6;         // share of each side that the centres span
  double min_cosine = 0.34;        // of the angle to an axis, 70 degrees: the bar tells lengths along it
  std::size_t min_along = 2;       // placements along each axis
  double min_move = 0.16;          // share of the bar by which a ball moves: 20 mm of 125; nearer is one place
};

// Errors: kInvalidArgument for a bar, a placement or rules outside their ranges, for names that are used
// twice and for centres that a camera cannot see; kDegenerate if two placements are one place (both named), if
// there are too few, or naming the direction that they do not span or along which too few of them run.
Status CheckPlacements(const BallBar& bar, std::span<const BarPlacement> placements,
                       const StereoCalibration& calibration, const PlacementRules& rules);

}  // namespace forgescan
