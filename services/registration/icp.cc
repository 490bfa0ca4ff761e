#include "services/registration/icp.h"

#include <cmath>

#include "services/registration/correspondences.h"

namespace forgescan {
namespace {

constexpr int kStillSteps = 3;             // motions below the limit in a row that end the fine stage
constexpr double kCoarseStopShare = 0.05;  // of the sample spacing: what pairing with samples can resolve
// While pairs still change, a direction may be badly seen for a moment: the coarse stage holds it, the fine
// stage stops only at a fraction of the eigenvalue that the result must have.
constexpr double kCoarseDamping = 1e-3;
constexpr double kPassingShare = 0.1;
constexpr double kSettledShare = 0.1;  // a motion below this share of the biweight's width lets it narrow,
constexpr double kNarrowing = 0.6;     // to this share of itself

constexpr double kRigidTolerance = 1e-3;  // of the start's rotation; hand-written poses carry 5 digits
constexpr double kLeastLeverMm = 1e-3;    // of a flat or straight model

struct Progress {
  Eigen::Isometry3d model_from_scan;
  int iterations = 0;
};

Status InRange(const char* name, double value, double low, double high) {
  if (value >= low && value <= high) return {};
  return Fail(ErrorCode::kInvalidArgument, "registration option {} is {}, allowed {} to {}", name, value, low,
              high);
}

Status CheckScan(const PointCloud& scan, const Eigen::Isometry3d& start) {
  if (!scan.normals.empty() && scan.normals.size() != scan.points.size()) {
    return Fail(ErrorCode::kInvalidArgument, "the scan has {} points but {} normals", scan.points.size(),
                scan.normals.size());
  }
  const Eigen::Matrix3d rotation = start.linear();
  const bool rigid = start.matrix().allFinite() && rotation.determinant() > 0 &&
                     (rotation * rotation.transpose() - Eigen::Matrix3d::Identity()).norm() < kRigidTolerance;
  if (rigid) return {};
  return Fail(ErrorCode::kInvalidArgument,
              "the start pose is not a rigid motion (rotation orthonormal to {}, finite)", kRigidTolerance);
}

StepFrame FrameOf(const RegistrationModel& model) {
  const Eigen::Vector3d half = 0.5 * (model.box_high() - model.box_low());
  // A flat or straight model still needs a lever to scale with.
  const auto across = [&](int i, int j) { return std::max(std::hypot(half[i], half[j]), kLeastLeverMm); };
  return {model.center(), {across(1, 2), across(2, 0), across(0, 1)}};
}

// Steps 3 to 7 with the k-d tree of samples, the threshold falling from the start's uncertainty to its floor.
Result<Progress> AlignCoarse(const ScanSample& sample, const RegistrationModel& model,
                             const IcpOptions& options, double gate_mm, Progress progress) {
  const double floor_mm = std::max(options.threshold_floor_mm, model.spacing_mm());
  for (int i = 0; i < options.max_iterations; ++i) {
    std::vector<Pair> pairs = PairWithSamples(sample, model, progress.model_from_scan, options);
    gate_mm = AdaptiveThreshold(pairs, gate_mm, floor_mm, options.threshold_sigmas);
    KeepNearest(pairs, gate_mm, options.keep_share);
    ASSIGN_OR_RETURN(const PoseStep step, SolveStep(pairs, FrameOf(model), {0, kCoarseDamping}));
    progress.model_from_scan = step.moved_from_before * progress.model_from_scan;
    ++progress.iterations;
    const double motion_mm = std::max(step.rotation_mm, step.translation_mm);
    if (gate_mm <= floor_mm && motion_mm < kCoarseStopShare * model.spacing_mm()) break;
  }
  // Not being at rest here is no failure: only the fine stage decides.
  return progress;
}

struct FineResult {
  Progress progress;
  double threshold_mm;
  bool converged;
};

// The same against the exact surface, until the far end of the part rests. The biweight starts as wide as the
// coarse stage can have left the pose off, and narrows to the noise as the pose settles: at the noise alone,
// the few faces across the part would count as outliers and the part would never slide home along itself.
Result<FineResult> AlignFine(const ScanSample& sample, const RegistrationModel& model,
                             const IcpOptions& options, Progress progress) {
  double gate_mm = 2 * std::max(options.threshold_floor_mm, model.spacing_mm());
  double least_cut_mm = gate_mm;
  int still = 0;
  for (int i = 0; i < options.max_iterations && still < kStillSteps; ++i) {
    std::vector<Pair> pairs = PairWithSurface(sample, model, progress.model_from_scan, gate_mm, options);
    gate_mm = AdaptiveThreshold(pairs, gate_mm, options.threshold_floor_mm, options.threshold_sigmas);
    const WeighedPairs weighed = WeighBiweight(pairs, gate_mm, least_cut_mm);
    ASSIGN_OR_RETURN(const PoseStep step,
                     SolveStep(pairs, FrameOf(model), {kPassingShare * options.min_eigenvalue}));
    progress.model_from_scan = step.moved_from_before * progress.model_from_scan;
    ++progress.iterations;
    const double motion_mm = std::max(step.rotation_mm, step.translation_mm);
    const bool narrow = weighed.cut_mm > least_cut_mm;
    still = narrow && motion_mm < options.stop_mm ? still + 1 : 0;
    if (motion_mm < kSettledShare * least_cut_mm) least_cut_mm *= kNarrowing;
  }
  return FineResult{progress, gate_mm, still >= kStillSteps};
}

// Re-pairs at the final pose and puts every figure of the result together.
Result<Registration> Describe(const ScanSample& sample, const RegistrationModel& model,
                              const FineResult& fine, const IcpOptions& options) {
  const Eigen::Isometry3d& pose = fine.progress.model_from_scan;
  std::vector<Pair> pairs = PairWithSurface(sample, model, pose, options.score_cap_mm, options);
  double score = 0;
  for (const Pair& pair : pairs) score += pair.distance_mm;
  Registration result;
  result.model_from_scan = pose;
  // The product of many steps drifts from orthonormal by rounding.
  result.model_from_scan.linear() = Eigen::Quaterniond(pose.linear()).normalized().toRotationMatrix();
  result.iterations = fine.progress.iterations;
  result.threshold_mm = std::min(fine.threshold_mm, options.score_cap_mm);
  result.considered = pairs.size();
  result.inliers = WeighBiweight(pairs, result.threshold_mm, 0).within;
  result.inlier_share = static_cast<double>(result.inliers) / static_cast<double>(pairs.size());
  result.capped_score_mm = score / static_cast<double>(pairs.size());
  ASSIGN_OR_RETURN(const PoseStep step, SolveStep(pairs, FrameOf(model), {options.min_eigenvalue}));
  result.rms_mm = step.rms_mm;
  result.weakest_eigenvalue = step.weakest_eigenvalue;
  result.covariance = step.covariance;
  result.center = model.center();
  return result;
}

Status Trust(const Registration& result, const IcpOptions& options) {
  if (result.inliers < options.min_inliers || result.inlier_share < options.min_inlier_share) {
    return Fail(ErrorCode::kUntrusted,
                "{} of {} points ({:.1f} %) lie on the model, at least {} and {:.1f} % are needed",
                result.inliers, result.considered, 100 * result.inlier_share, options.min_inliers,
                100 * options.min_inlier_share);
  }
  if (result.correction_mm > 2 * options.start_translation_mm ||
      result.correction_rad > 2 * options.start_rotation_rad) {
    return Fail(
        ErrorCode::kUntrusted,
        "the pose ended {:.2f} mm and {:.4f} rad from its start, which may be off by {} mm and {} rad",
        result.correction_mm, result.correction_rad, options.start_translation_mm,
        options.start_rotation_rad);
  }
  return {};
}

}  // namespace

Status Check(const IcpOptions& o) {
  RETURN_IF_ERROR(InRange("start_translation_mm", o.start_translation_mm, 0, 1e4));
  RETURN_IF_ERROR(InRange("start_rotation_rad", o.start_rotation_rad, 0, 0.5));
  RETURN_IF_ERROR(InRange("threshold_sigmas", o.threshold_sigmas, 0, 10));
  RETURN_IF_ERROR(InRange("keep_share", o.keep_share, 0.1, 1));
  RETURN_IF_ERROR(InRange("threshold_floor_mm", o.threshold_floor_mm, 1e-3, 100));
  RETURN_IF_ERROR(InRange("normal_limit_rad", o.normal_limit_rad, 0.01, 3.2));
  RETURN_IF_ERROR(InRange("coarse_points", static_cast<double>(o.coarse_points), 100, 1e7));
  RETURN_IF_ERROR(InRange("fine_points", static_cast<double>(o.fine_points), 100, 1e8));
  RETURN_IF_ERROR(InRange("max_iterations", o.max_iterations, 1, 10000));
  RETURN_IF_ERROR(InRange("stop_mm", o.stop_mm, 1e-6, 1));
  RETURN_IF_ERROR(InRange("min_inlier_share", o.min_inlier_share, 0, 1));
  RETURN_IF_ERROR(InRange("min_eigenvalue", o.min_eigenvalue, 0, 1.0 / 3));
  return InRange("score_cap_mm", o.score_cap_mm, 1e-3, 1000);
}

Result<Registration> RegisterScan(const PointCloud& scan, const RegistrationModel& model,
                                  const Eigen::Isometry3d& start, const IcpOptions& options) {
  RETURN_IF_ERROR(Check(options));
  RETURN_IF_ERROR(CheckScan(scan, start));
  const double margin_mm = options.start_translation_mm + options.start_rotation_rad * model.reach_mm() +
                           options.threshold_floor_mm;
  const ScanSample cropped = CropToModel(scan, model, start, margin_mm);
  if (cropped.size() < options.min_inliers) {
    return Fail(ErrorCode::kDegenerate,
                "{} of {} scan points lie within {:.1f} mm of the model's box, at least {} are needed",
                cropped.size(), scan.size(), margin_mm, options.min_inliers);
  }
  ASSIGN_OR_RETURN(const Progress coarse,
                   AlignCoarse(Thin(cropped, options.coarse_points), model, options, margin_mm, {start}));
  const ScanSample fine_sample = Thin(cropped, options.fine_points);
  ASSIGN_OR_RETURN(const FineResult fine, AlignFine(fine_sample, model, options, coarse));
  if (!fine.converged) {
    return Fail(ErrorCode::kNotConverged, "registration was not at rest ({} mm) after {} iterations",
                options.stop_mm, fine.progress.iterations);
  }
  ASSIGN_OR_RETURN(Registration result, Describe(fine_sample, model, fine, options));
  const Eigen::Isometry3d correction = result.model_from_scan * start.inverse();
  result.correction_mm = (correction * model.center() - model.center()).norm();
  result.correction_rad = Eigen::AngleAxisd(correction.linear()).angle();
  RETURN_IF_ERROR(Trust(result, options));
  return result;
}

}  // namespace forgescan
