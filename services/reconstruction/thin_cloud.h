// A smaller cloud of the same surface.
#pragma once

#include "services/common/geometry/point_cloud.h"

namespace forgescan {

// Points 0, n, 2n, ... unaltered, all marked with the view they belong to. `cloud` has normals and sigma_mm;
// n >= 1.
PointCloud EveryNthPoint(const PointCloud& cloud, int n, int view);

}  // namespace forgescan
