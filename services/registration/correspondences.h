// Pairing of measured points with the model, and which pairs to believe (steps 3 to 5 of section 2.2.2).
#pragma once

#include <Eigen/Geometry>
#include <vector>

#include "services/registration/icp.h"
#include "services/registration/pose_step.h"
#include "services/registration/registration_model.h"
#include "services/registration/scan_sample.h"

namespace forgescan {

// Step 3 with RegistrationModel::FindSurfaceRoughly: one pair per point, however far; weight 0 where the
// normals disagree.
std::vector<Pair> PairRoughly(const ScanSample& sample, const RegistrationModel& model,
                              const Eigen::Isometry3d& model_from_scan, const IcpOptions& options);

// Step 3 with the nearest point of the surface within `reach_mm`; weight 0 where there is none or the normals
// disagree, with distance_mm = reach_mm in the first case. Weight 0 also on a rim: a point beyond it has no
// partner, and would hold the pose by a face that was not seen.
std::vector<Pair> PairWithSurface(const ScanSample& sample, const RegistrationModel& model,
                                  const Eigen::Isometry3d& model_from_scan, double reach_mm,
                                  const IcpOptions& options);

// Distance of every point to the surface, at most cap_mm. Units: mm.
std::vector<float> CappedDistances(const ScanSample& sample, const RegistrationModel& model,
                                   const Eigen::Isometry3d& model_from_scan, double cap_mm, unsigned threads);

// Step 4: Eq. (6) over the pairs with weight and no farther than gate_mm; never above gate_mm nor below
// floor_mm.
double AdaptiveThreshold(const std::vector<Pair>& pairs, double gate_mm, double floor_mm, double sigmas);

// In place of step 5: Tukey's biweight of the distance for pairs with weight, 0 from threshold_mm on.
void WeighByDistance(std::vector<Pair>& pairs, double threshold_mm);

struct WeighedPairs {
  std::size_t within;  // pairs within the threshold
  double cut_mm;       // residual at which the weight becomes 0
};

// Weight 0 for pairs beyond threshold_mm, Tukey's biweight of the point-to-plane residual for the rest, with
// the scale from their median, but no narrower than least_cut_mm.
WeighedPairs WeighBiweight(std::vector<Pair>& pairs, double threshold_mm, double least_cut_mm);

}  // namespace forgescan
