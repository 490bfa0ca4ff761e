// The paper's registration, plainly: what the production one (icp.h) is measured against, in tests and in
// tests/bench/registration_bench.cc. Not used by a service.
//
// Source: Han et al., Sensors 2018, 18(12), 4368, section 2.2.2, steps 1 to 7. Two things differ, without
// which it could not be compared: the rotation is the exact Rz Ry Rx of Eq. (7) instead of its linearised
// matrix, and the end is a rest of the far end below stop_mm, three times in a row, instead of Eq. (9) and
// (10), which allow 4 mm there.
#pragma once

#include <Eigen/Geometry>
#include <functional>
#include <span>
#include <vector>

#include "services/common/geometry/point_cloud.h"
#include "services/common/result.h"
#include "services/registration/registration_model.h"
#include "services/registration/sample_tree.h"

namespace forgescan {

struct PaperIcpOptions {
  double threshold_sigmas = 2;  // a of Eq. (6); the paper does not give it
  double keep_share = 0.7;      // step 5
  double stop_mm = 0.01;        // motion of the far end, and of the centre
  int max_iterations = 300;     // the paper's 30 are not enough for the tight end
};

struct PaperRegistration {
  Eigen::Isometry3d model_from_scan;
  int iterations;
  bool at_rest;  // else max_iterations ended it
};

// Step 3: the nearest sample of the model for each of the points, which are finite; SampleTree::Find does it
// as the paper's step 2 does. Units: mm. Frames: model.
using SampleSearch = std::function<std::vector<NearestSample>(std::span<const Eigen::Vector3f>)>;

// Purpose: reference. Shape: every point of the scan takes part in every step; normals are not used. Frames:
// start = model_from_scan. Errors: kInvalidArgument for a scan with points that are not finite; kDegenerate
// if the kept points do not fix the pose.
Result<PaperRegistration> RegisterAsInPaper(const PointCloud& scan, const RegistrationModel& model,
                                            const SampleSearch& search, const Eigen::Isometry3d& start,
                                            const PaperIcpOptions& options);

}  // namespace forgescan
