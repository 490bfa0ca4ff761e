// Pairing of measured points with the model, and which pairs to believe (steps 3 to 5 of section 2.2.2).
#pragma once

#include <Eigen/Geometry>
#include <vector>

#include "services/common/geometry/point_cloud.h"
#include "services/registration/icp.h"
#include "services/registration/pose_step.h"
#include "services/registration/registration_model.h"

namespace forgescan {

// The points a stage works on. Shape: normals has the length of points, or 0. Frames: scan.
struct ScanSample {
  std::vector<Eigen::Vector3f> points, normals;
  std::size_t size() const { return points.size(); }
};

// Every finite point that lies, moved by start, in the model's box grown by margin_mm.
ScanSample CropToModel(const PointCloud& scan, const RegistrationModel& model, const Eigen::Isometry3d& start,
                       double margin_mm);

// Every n-th point, with the smallest n that gives at most max_points.
ScanSample Thin(const ScanSample& sample, std::size_t max_points);

// Step 3 with the nearest model sample: one pair per point; weight 0 where the normals disagree.
std::vector<Pair> PairWithSamples(const ScanSample& sample, const RegistrationModel& model,
                                  const Eigen::Isometry3d& model_from_scan, const IcpOptions& options);

// Step 3 with the nearest point of the surface within `reach_mm`; weight 0 where there is none or the normals
// disagree, with distance_mm = reach_mm in the first case. Weight 0 also on a rim: a point beyond it has no
// partner, and would hold the pose by a face that was not seen.
std::vector<Pair> PairWithSurface(const ScanSample& sample, const RegistrationModel& model,
                                  const Eigen::Isometry3d& model_from_scan, double reach_mm,
                                  const IcpOptions& options);

// Step 4: Eq. (6) over the pairs with weight and no farther than gate_mm; never above gate_mm nor below
// floor_mm.
double AdaptiveThreshold(const std::vector<Pair>& pairs, double gate_mm, double floor_mm, double sigmas);

// Weight 0 for pairs beyond threshold_mm; then step 5, weight 0 for all but the nearest keep_share of what is
// left.
void KeepNearest(std::vector<Pair>& pairs, double threshold_mm, double keep_share);

struct WeighedPairs {
  std::size_t within;  // pairs within the threshold
  double cut_mm;       // residual at which the weight becomes 0
};

// Weight 0 for pairs beyond threshold_mm, Tukey's biweight of the point-to-plane residual for the rest, with
// the scale from their median, but no narrower than least_cut_mm.
WeighedPairs WeighBiweight(std::vector<Pair>& pairs, double threshold_mm, double least_cut_mm);

}  // namespace forgescan
