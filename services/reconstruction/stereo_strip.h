// The rows of one thread, from decoded views to points, with a window of a few rows in the cache.
#pragma once

#include <vector>

#include "services/common/geometry/point_cloud.h"
#include "services/reconstruction/histogram_median.h"
#include "services/reconstruction/projector_model.h"
#include "services/reconstruction/stereo/kernel.h"
#include "services/reconstruction/stereo_points.h"

namespace forgescan {

constexpr double kMaxResidualPx = 64;  // larger ones count as this in a median

// What all strips of a pair of views share.
struct StereoTask {
  const StereoKernel& kernel;
  RawView left;
  RawView right;
  MatchLimits limits;
  const StereoRig& rig;
  const ReconstructionConfig& config;
  int sample_step = 1;  // of a row's points
};

struct StripResult {
  PointCloud cloud_in_camera;
  std::vector<LitPoint> sample;
  StereoCounts count;
  HistogramMedian projector_residuals_px{-kMaxResidualPx, kMaxResidualPx, 1 << 15};
};

// cloud: memory to be used again. What a row yields does not depend on the strip it is in.
StripResult ComputeStrip(const StereoTask& task, int begin, int end, PointCloud cloud);

}  // namespace forgescan
