// The plain method that the paper compares itself with in its Fig. 10.
#pragma once

#include <Eigen/Geometry>
#include <vector>

#include "services/common/geometry/triangle_index.h"

namespace forgescan {

struct TrimmedIcpOptions {
  double overlap_share = 0.78;  // of the scan that belongs to the part: the nearest so many pairs count
  std::size_t points = 5'000;   // of the scan, evenly strided
  int max_iterations = 100;
  double stop_share = 1e-5;  // least change of the mean square of the kept pairs
};

struct TrimmedIcpResult {
  Eigen::Isometry3d model_from_scan;
  int iterations = 0;
  double rms_mm = 0;  // of the kept pairs
};

// Nearest point of the surface for each point, the nearest share of the pairs, rigid motion between them
// (Umeyama), again until the mean square rests. Source: Chetverikov et al., The Trimmed Iterative Closest
// Point Algorithm, ICPR 2002. Frames: surface in the model's, mm. Knows no refusal: it always answers.
TrimmedIcpResult AlignTrimmed(const std::vector<Eigen::Vector3f>& scan, const TriangleIndex& surface,
                              const Eigen::Isometry3d& start, const TrimmedIcpOptions& options);

}  // namespace forgescan
