#include "services/registration/icp.h"

#include <cmath>

#include "services/registration/correspondences.h"
#include "services/registration/icp_stages.h"
#include "services/registration/rival_poses.h"

namespace forgescan {
namespace {

// The first part of the fine stage, on few points, ends at so many times stop_mm: the second does the rest.
constexpr double kSettledStops = 5;
constexpr double kRigidTolerance = 1e-3;  // of the start's rotation; hand-written poses carry 5 digits

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

// Coarse, then fine until the pose has settled, on few points; then fine until it rests, on many.
Result<FineState> Align(const ScanSample& few, const ScanSample& many, const RegistrationModel& model,
                        const IcpOptions& options, const AlignState& start) {
  ASSIGN_OR_RETURN(const AlignState coarse, AlignCoarse(few, model, options, start));
  ASSIGN_OR_RETURN(const FineState settled, AlignFine(few, model, options, kSettledStops * options.stop_mm,
                                                      BeginFine(model, options, coarse)));
  ASSIGN_OR_RETURN(const FineState fine, AlignFine(many, model, options, options.stop_mm, settled));
  if (fine.at_rest) return fine;
  return Fail(ErrorCode::kNotConverged, "registration was not at rest ({} mm) after {} iterations",
              options.stop_mm, fine.align.iterations);
}

// Re-pairs at the final pose and puts every figure of the result together.
Result<Registration> Describe(const ScanSample& sample, const RegistrationModel& model, const FineState& fine,
                              const IcpOptions& options) {
  const Eigen::Isometry3d& pose = fine.align.model_from_scan;
  std::vector<Pair> pairs = PairWithSurface(sample, model, pose, options.score_cap_mm, options);
  double score = 0;
  for (const Pair& pair : pairs) score += pair.distance_mm;
  Registration result;
  result.model_from_scan = pose;
  // The product of many steps drifts from orthonormal by rounding.
  result.model_from_scan.linear() = Eigen::Quaterniond(pose.linear()).normalized().toRotationMatrix();
  result.iterations = fine.align.iterations;
  result.threshold_mm = std::min(fine.align.gate_mm, options.score_cap_mm);
  result.considered = pairs.size();
  result.inliers = WeighBiweight(pairs, result.threshold_mm, 0).within;
  result.inlier_share = static_cast<double>(result.inliers) / static_cast<double>(pairs.size());
  result.capped_score_mm = score / static_cast<double>(pairs.size());
  ASSIGN_OR_RETURN(const PoseStep step,
                   SolveStep(pairs, FrameOf(model), {options.min_eigenvalue, 0, options.threads}));
  result.rms_mm = step.rms_mm;
  result.weakest_eigenvalue = step.motions[0].eigenvalue;
  for (const HeldMotion& held : step.motions) {
    if (held.eigenvalue >= options.weak_eigenvalue) break;
    result.weak_directions.push_back({NameOfMotion(held.motion, FrameOf(model)), held.eigenvalue});
  }
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
  RETURN_IF_ERROR(InRange("threshold_floor_mm", o.threshold_floor_mm, 1e-3, 100));
  RETURN_IF_ERROR(InRange("normal_limit_rad", o.normal_limit_rad, 0.01, 3.2));
  RETURN_IF_ERROR(InRange("coarse_points", static_cast<double>(o.coarse_points), 100, 1e7));
  RETURN_IF_ERROR(InRange("fine_points", static_cast<double>(o.fine_points), 100, 1e8));
  RETURN_IF_ERROR(InRange("max_iterations", o.max_iterations, 1, 10000));
  RETURN_IF_ERROR(InRange("stop_mm", o.stop_mm, 1e-6, 1));
  RETURN_IF_ERROR(InRange("min_inlier_share", o.min_inlier_share, 0, 1));
  RETURN_IF_ERROR(InRange("min_eigenvalue", o.min_eigenvalue, 0, 1.0 / 3));
  RETURN_IF_ERROR(InRange("weak_eigenvalue", o.weak_eigenvalue, 0, 1.0 / 3));
  RETURN_IF_ERROR(InRange("rival_ratio", o.rival_ratio, 0, 100));
  RETURN_IF_ERROR(InRange("turned_ratio", o.turned_ratio, 0, 100));
  RETURN_IF_ERROR(InRange("rival_cap_mm", o.rival_cap_mm, 1e-3, 1000));
  return InRange("score_cap_mm", o.score_cap_mm, 1e-3, 1000);
}

Result<Registration> RegisterScan(const PointCloud& scan, const RegistrationModel& model,
                                  const Eigen::Isometry3d& start, const IcpOptions& options) {
  RETURN_IF_ERROR(Check(options));
  RETURN_IF_ERROR(CheckScan(scan, start));
  const double margin_mm = options.start_translation_mm + options.start_rotation_rad * model.reach_mm() +
                           options.threshold_floor_mm;
  const std::vector<std::uint32_t> in_box = FindInBox(scan, model, start, margin_mm, options.threads);
  if (in_box.size() < options.min_inliers) {
    return Fail(ErrorCode::kDegenerate,
                "{} of {} scan points lie within {:.1f} mm of the model's box, at least {} are needed",
                in_box.size(), scan.size(), margin_mm, options.min_inliers);
  }
  const ScanSample few = TakeSample(scan, in_box, options.coarse_points);
  const ScanSample many = TakeSample(scan, in_box, options.fine_points);
  ASSIGN_OR_RETURN(const FineState fine, Align(few, many, model, options, {start, 0, margin_mm}));
  ASSIGN_OR_RETURN(Registration result, Describe(many, model, fine, options));
  const Eigen::Isometry3d correction = result.model_from_scan * start.inverse();
  result.correction_mm = (correction * model.center() - model.center()).norm();
  result.correction_rad = Eigen::AngleAxisd(correction.linear()).angle();
  RETURN_IF_ERROR(Trust(result, options));
  if (options.rival_ratio > 0) {
    if (const auto rival = FindRival(few, model, start, result.model_from_scan, options)) {
      RETURN_IF_ERROR(CheckRival(*rival, options));
      result.rival_ratio = rival->scores.Ratio();
    }
  }
  return result;
}

}  // namespace forgescan
