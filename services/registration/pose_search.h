// The pose of a part of which nobody knows how it lies: turned, reversed, upside down.
#pragma once

#include "services/common/geometry/point_cloud.h"
#include "services/common/result.h"
#include "services/registration/icp.h"
#include "services/registration/registration_model.h"

namespace forgescan {

// Purpose: RegisterScan without a start. Method: the principal axes of scan and model laid onto each other in
// all orders and directions and turned about the longest one in equal steps; a short alignment from each; the
// best ones, and the best one's half turns about the model's principal axes, through RegisterScan. What that
// refuses still counts as a rival of the pose chosen, and so do the half turns of it. Deterministic: no
// random starts. Shape, frames: as RegisterScan; the start's uncertainty in `options` is that of the last
// step. Foreign points may be there as long as the part's own decide the principal axes to some 15 degrees.
// Errors: kInvalidArgument (options, arrays of different length); kDegenerate (too few finite points);
// kUntrusted if no pose explains enough points, or two that differ do about equally well
// (options.rival_ratio): which pose it is cannot be told. Cost: see the bench, benchmark pose_search.
Result<Registration> SearchPose(const PointCloud& scan, const RegistrationModel& model,
                                const IcpOptions& options);

}  // namespace forgescan
