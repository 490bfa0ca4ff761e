// The centre of a ball of the pair in the cloud of a view.
#pragma once

#include "services/common/geometry/point_cloud.h"
#include "services/common/result.h"

namespace forgescan {

struct FittedBall {
  Eigen::Vector3d center;  // with the known radius
  double radius_mm;        // had it been free
};

// From the points within 60 degrees of the direction to the camera, about the centre of a free fit that
// starts where the ball was put. Frames: all in the cloud's, mm. Errors: those of FitSphere.
Result<FittedBall> FitBall(const PointCloud& cloud_in_array, const Eigen::Vector3d& placed,
                           const Eigen::Vector3d& camera_in_array);

}  // namespace forgescan
