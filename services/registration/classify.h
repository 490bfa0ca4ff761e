// After registration: which scan points belong to the part.
#pragma once

#include <Eigen/Geometry>
#include <cstdint>
#include <vector>

#include "services/common/geometry/point_cloud.h"
#include "services/registration/registration_model.h"

namespace forgescan {

struct ClassifyOptions {
  double max_distance_mm = 3;     // to the design surface
  double normal_limit_rad = 1.0;  // between scan and model normal; used where the scan has normals
  unsigned threads = 0;           // 0: as many as the host has; the result does not depend on it
};

// Indices of the points of the part, ascending; all others are foreign. A point that is not finite is
// foreign. Cost: tests/bench/registration_bench.cc.
std::vector<std::uint32_t> FindPartPoints(const PointCloud& scan, const RegistrationModel& model,
                                          const Eigen::Isometry3d& model_from_scan,
                                          const ClassifyOptions& options);

}  // namespace forgescan
