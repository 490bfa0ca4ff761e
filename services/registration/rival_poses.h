// Other poses that explain the scan about as well as the one found: an alignment that only walks downhill
// does not see them.
#pragma once

#include <optional>
#include <string>

#include "services/common/result.h"
#include "services/registration/icp.h"
#include "services/registration/registration_model.h"
#include "services/registration/scan_sample.h"

namespace forgescan {

// Two poses compared on the points that lie within the cap of the surface in at least one of them. Units: mm.
struct PoseScores {
  double one_mm;  // mean distance, each at most the cap
  double other_mm;
  double Ratio() const { return other_mm / one_mm; }  // infinite or NaN on exact data
};
PoseScores CompareScores(const ScanSample& sample, const RegistrationModel& model,
                         const Eigen::Isometry3d& one, const Eigen::Isometry3d& other,
                         const IcpOptions& options);

// Frames: as Registration.
struct RivalPose {
  Eigen::Isometry3d model_from_scan;
  PoseScores scores;   // one: the pose found, other: this one
  bool from_start;     // the start allows it as well; else it is a half turn away
  std::string motion;  // from the pose found to this one, for a person
};

// Where a rival is looked for.
struct RivalSearch {
  const ScanSample& sample;
  const RegistrationModel& model;
  const Eigen::Isometry3d& found;
  const IcpOptions& options;
};

// A short alignment from there, from_start left false; nothing if it fails, is hopeless or ends in the valley
// of `found`.
std::optional<RivalPose> SettleRival(const RivalSearch& search, const Eigen::Isometry3d& from,
                                     double gate_mm);

// Purpose: the rival that fits best, of those the start allows and of the half turns. Method: the score along
// and about each of the model's axes, as far as twice the start's uncertainty; from every valley that is not
// the one of `found`, and from a half turn about each axis, a short alignment. A half turn that maps the
// model onto itself is the same pose by another name and is left out. Nothing if every alignment comes back
// to `found`. Cost: in tests/bench, registration/ours less ours_without_rival_check.
std::optional<RivalPose> FindRival(const ScanSample& sample, const RegistrationModel& model,
                                   const Eigen::Isometry3d& start, const Eigen::Isometry3d& found,
                                   const IcpOptions& options);

// Errors: kUntrusted with both scores and the motion between the poses, if the rival the start allows scores
// no worse than options.rival_ratio times the pose found, or the half turned one better than
// options.turned_ratio of it.
Status CheckRival(const RivalPose& rival, const IcpOptions& options);

// Whether a motion that maps the model onto itself (IsSymmetry) lies so near that no corner of the model's box ends farther than within_mm from where
// `motion` takes it: for a motion between two measured poses.
bool IsNearSymmetry(const RegistrationModel& model, const Eigen::Isometry3d& motion, double within_mm);

}  // namespace forgescan
