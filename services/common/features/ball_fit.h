// The centre of a ball of known radius in the cloud of one view.
#pragma once

#include "services/common/geometry/point_cloud.h"
#include "services/common/result.h"

namespace forgescan {

struct BallSearch {
  Eigen::Vector3d placed;  // where it was put, within 0.4 of the radius
  Eigen::Vector3d camera;  // where it was seen from
  double radius_mm = 0;    // as certified
};

struct FittedBall {
  Eigen::Vector3d center;  // with the known radius
  double radius_mm;        // had it been free
};

// From the points within 60 degrees of the direction to the camera, about the centre of a free fit that
// starts where the ball was put. Frames: all in the cloud's, mm. Errors: those of FitSphere;
// kDegenerate if the centre does not become finite.
Result<FittedBall> FitBall(const PointCloud& cloud, const BallSearch& ball);

}  // namespace forgescan
