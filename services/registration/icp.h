// Registration of a scan with the design model in the presence of foreign points (conveyor, clamp).
//
// Source: Han et al., Sensors 2018, 18(12), 4368, section 2.2.2, steps 1-7. Beyond the paper, because its
// rules alone leave up to 4 mm at the end of a long part:
//  - points outside the model's box, grown by how far the start may be off, are left out from the beginning;
//  - pairs beyond the threshold of the previous step, or with normals too far apart, do not enter mean and
//  sigma of Eq. (6)
//    (our reading of "P is updated to P'"; with most points foreign, their distances would otherwise be the
//    statistics);
//  - distances are to the surface instead of to samples of it: roughly at first, by a grid prepared with the
//  model, exactly at last;
//  - the last steps weigh pairs by Tukey's biweight instead of keeping the nearest 70 % (a hard cut holds the
//  pose where it is);
//  - the end is a motion below stop_mm at the far end of the part, three times in a row, instead of Eq. (9)
//  and (10);
//  - a pose that has a rival which fits about as well is refused.
#pragma once

#include <Eigen/Geometry>
#include <limits>
#include <string>
#include <vector>

#include "services/common/geometry/point_cloud.h"
#include "services/common/result.h"
#include "services/registration/pose_step.h"
#include "services/registration/registration_model.h"

namespace forgescan {

struct IcpOptions {
  double start_translation_mm = 10;   // how far the start may be off, at the model's centre
  double start_rotation_rad = 0.053;  // 3 degrees
  double threshold_sigmas = 2;        // a of Eq. (6); at 1.5 and below, a start in 20 of the test axle failed
  double threshold_floor_mm = 1;      // Eq. (6) goes no lower: noise and the deviations a good part may have
  double normal_limit_rad = 0.7;      // between scan and model normal; used where the scan has normals
  std::size_t coarse_points = 8'000;  // of the scan, evenly strided, until the pose has settled
  std::size_t fine_points = 40'000;   // from then on
  int max_iterations = 100;           // of each stage
  double stop_mm = 0.002;             // motion of the far end, and of the centre
  std::size_t min_inliers = 500;
  double min_inlier_share = 0.4;  // of the points in the grown box
  double min_eigenvalue = 5e-4;   // see PoseStep: below, a direction is held by noise only
  double weak_eigenvalue = 5e-3;  // below, a direction is named in Registration::weak_directions
  double score_cap_mm = 3;        // of Registration::capped_score_mm
  // See rival_poses.h. A rival within the start's uncertainty must score worse than rival_ratio times the
  // pose found; 0: rivals are not looked for. A half turned one must not score better than turned_ratio times
  // it: the start says how the part lies.
  double rival_ratio = 1.5;
  double turned_ratio = 0.8;
  double rival_cap_mm = 1;  // distances count no more than this when poses are compared
  unsigned threads = 0;     // 0: as many as the host has; the result does not depend on it
};

// Errors: kInvalidArgument with name, value and allowed range of the first wrong option.
Status Check(const IcpOptions& options);

// Frames: scan = frame of the cloud, model = frame of the design model.
struct Registration {
  Eigen::Isometry3d model_from_scan;
  int iterations = 0;             // of both stages
  std::size_t considered = 0;     // points in the grown box that were used in the last stage
  std::size_t inliers = 0;        // of them, within threshold_mm and with a fitting normal
  double inlier_share = 0;        // inliers / considered
  double threshold_mm = 0;        // Eq. (6) at the end
  double rms_mm = 0;              // weighted, point to plane, of the inliers
  double capped_score_mm = 0;     // mean over considered of min(distance, score_cap_mm)
  double weakest_eigenvalue = 0;  // see PoseStep
  struct WeakDirection {
    std::string name;  // see NameOfMotion
    double eigenvalue;
  };
  std::vector<WeakDirection> weak_directions;  // weakest first
  // Score of the strongest rival over that of this pose; infinite if there is none.
  double rival_ratio = std::numeric_limits<double>::infinity();
  double correction_mm = 0;  // how far the start was off, at the model's centre
  double correction_rad = 0;
  Matrix6 covariance =
      Matrix6::Zero();  // see PoseStep, about center; correlated errors of a view are not in it
  Eigen::Vector3d center = Eigen::Vector3d::Zero();  // of the model's bounding box, mm, model frame
};

// Purpose: the pose of the part. Shape: scan with or without normals; points that are not finite are left
// out. `start` = model_from_scan from the calibrated station, off by no more than the options say. Errors:
// kInvalidArgument (options, arrays of different length, start not finite); kDegenerate (too few points in
// the box, or the points do not fix the pose: which motion); kNotConverged; kUntrusted (too few inliers, a
// result farther from the start than the start may be off, or a rival pose). Never a pose that did not
// converge. Cost: tests/bench/registration_bench.cc.
Result<Registration> RegisterScan(const PointCloud& scan, const RegistrationModel& model,
                                  const Eigen::Isometry3d& start, const IcpOptions& options);

}  // namespace forgescan
