// The two stages of the alignment; RegisterScan (icp.h) runs them one after the other, the searches for other
// poses (rival_poses.h, pose_search.h) by themselves.
#pragma once

#include "services/common/result.h"
#include "services/registration/icp.h"
#include "services/registration/pose_step.h"
#include "services/registration/registration_model.h"
#include "services/registration/scan_sample.h"

namespace forgescan {

struct AlignState {
  Eigen::Isometry3d model_from_scan;
  int iterations = 0;  // so far
  double gate_mm = 0;  // pairs farther apart do not count
};

// The model's box as the frame of the steps.
StepFrame FrameOf(const RegistrationModel& model);

// Steps 3 to 7 with rough distances, the threshold falling from gate_mm to its floor. Not being at rest after
// max_iterations is no failure: only the fine stage decides. Errors: kDegenerate if fewer than 6 pairs are
// left.
Result<AlignState> AlignCoarse(const ScanSample& sample, const RegistrationModel& model,
                               const IcpOptions& options, AlignState state);

struct FineState {
  AlignState align;
  double least_cut_mm;  // the biweight's width, see below
  bool at_rest = false;
};

// Where the fine stage begins after the coarse one.
FineState BeginFine(const RegistrationModel& model, const IcpOptions& options, const AlignState& coarse);

// The same against the exact surface, until the far end of the part moves less than stop_mm, three times in a
// row. The biweight starts as wide as the coarse stage can have left the pose off, and narrows to the noise
// as the pose settles: at the noise alone, the few faces across the part would count as outliers and the part
// would never slide home along itself. Errors: kDegenerate.
Result<FineState> AlignFine(const ScanSample& sample, const RegistrationModel& model,
                            const IcpOptions& options, double stop_mm, FineState state);

}  // namespace forgescan
