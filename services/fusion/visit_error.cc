#include "services/fusion/visit_error.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "services/common/geometry/dense_solvers.h"

namespace forgescan {
namespace {

using Matrix6 = Eigen::Matrix<double, 6, 6>;

constexpr int kSteps = 3;  // of the robust weights: the motion itself is all but linear
constexpr double kHuberSigmas = 3;

// A place both clouds have. Twist: shift of the pivot, turn about it; it moves the point by gradient . twist.
struct Match {
  std::uint64_t patch;
  Vector6 gradient;
  double distance_mm;  // of the cell now above the standing one
  double variance_mm2;
};

struct Matches {
  std::vector<Match> near;  // by patches
  std::size_t far = 0;
};

// The weights divide by it.
bool HasVariance(const SurfaceCell& cell) {
  return std::isfinite(cell.variance_mm2) && cell.variance_mm2 > 0;
}

Matches Join(std::span<const SurfaceCell> standing, std::span<const SurfaceCell> now,
             const Eigen::Vector3d& pivot, const VisitErrorOptions& options) {
  Matches matches;
  for (std::size_t i = 0, j = 0; i < standing.size() && j < now.size();) {
    const SurfaceCell &a = standing[i], &b = now[j];
    i += a.key <= b.key ? 1 : 0;
    j += b.key <= a.key ? 1 : 0;
    if (a.key != b.key || !HasVariance(a) || !HasVariance(b) ||
        a.normal.dot(b.normal) < options.min_cos_normals) {
      continue;
    }
    const Eigen::Vector3d normal = (a.normal + b.normal).normalized();
    const double distance_mm = normal.dot(b.point - a.point);
    if (distance_mm > options.hidden_mm) continue;
    if (std::abs(distance_mm) > options.max_distance_mm) {
      ++matches.far;
      continue;
    }
    const std::uint64_t patch =
        DirectionKey(a.point, options.patch_rad).value_or(0);  // NaN: refused in the end
    Match match{patch, {}, distance_mm, a.variance_mm2 + b.variance_mm2};
    match.gradient << normal, (b.point - pivot).cross(normal);
    matches.near.push_back(match);
  }
  std::stable_sort(matches.near.begin(), matches.near.end(),
                   [](const Match& a, const Match& b) { return a.patch < b.patch; });
  return matches;
}

struct System {
  Matrix6 information;
  Vector6 right_side = Vector6::Zero();
};

// The matches of a patch tell its height no better than patch_mm, however many they are.
void AddPatch(std::span<const Match> patch, const Vector6& twist, double patch_mm, System& system) {
  Matrix6 information = Matrix6::Zero();
  Vector6 right_side = Vector6::Zero();
  double weights = 0;
  for (const Match& match : patch) {
    const double left_mm = std::abs(match.distance_mm + match.gradient.dot(twist));
    const double trusted_mm = kHuberSigmas * std::sqrt(match.variance_mm2 + patch_mm * patch_mm);
    const double weight = std::min(1.0, trusted_mm / std::max(left_mm, trusted_mm)) / match.variance_mm2;
    information += weight * match.gradient * match.gradient.transpose();
    right_side -= weight * match.distance_mm * match.gradient;
    weights += weight;
  }
  const double share = 1 / (1 + weights * patch_mm * patch_mm);
  system.information += share * information;
  system.right_side += share * right_side;
}

Vector6 RobotAlone(const VisitErrorOptions& options) {
  Vector6 standard;
  standard << Eigen::Vector3d::Constant(options.robot_shift_mm),
      Eigen::Vector3d::Constant(options.robot_turn_rad);
  return standard;
}

System Build(const std::vector<Match>& matches, const Vector6& twist, const VisitErrorOptions& options) {
  System system;
  system.information = RobotAlone(options).cwiseAbs2().cwiseInverse().asDiagonal();
  for (auto begin = matches.begin(); begin != matches.end();) {
    const auto end =
        std::find_if(begin, matches.end(), [&](const Match& match) { return match.patch != begin->patch; });
    AddPatch({begin, end}, twist, options.patch_mm, system);
    begin = end;
  }
  return system;
}

Eigen::Isometry3d MotionOf(const Vector6& twist, const Eigen::Vector3d& pivot) {
  const Eigen::Vector3d turn = twist.tail<3>();
  const double angle = turn.norm();
  const Eigen::Vector3d axis = angle > 0 ? Eigen::Vector3d(turn / angle) : Eigen::Vector3d::UnitX();
  return Eigen::Translation3d(pivot + twist.head<3>()) * Eigen::AngleAxisd(angle, axis) *
         Eigen::Translation3d(-pivot);
}

// How far a patch as a whole lies off where all of them together put it.
struct PatchResidual {
  double distance_mm = 0, sigmas = 0;
};

PatchResidual WorstPatch(const std::vector<Match>& matches, const Vector6& twist,
                         const VisitErrorOptions& options) {
  PatchResidual worst;
  for (auto begin = matches.begin(); begin != matches.end();) {
    const auto end =
        std::find_if(begin, matches.end(), [&](const Match& match) { return match.patch != begin->patch; });
    double sum_mm = 0, weights = 0;
    for (auto match = begin; match != end; ++match) {
      sum_mm += (match->distance_mm + match->gradient.dot(twist)) / match->variance_mm2;
      weights += 1 / match->variance_mm2;
    }
    const double distance_mm = std::abs(sum_mm / weights);
    const double sigma_mm = std::sqrt(1 / weights + options.patch_mm * options.patch_mm);
    if (distance_mm / sigma_mm > worst.sigmas) worst = {distance_mm, distance_mm / sigma_mm};
    begin = end;
  }
  return worst;
}

// What no robot does is none of its error.
Status CheckMotion(const std::vector<Match>& matches, const Vector6& twist,
                   const VisitErrorOptions& options) {
  const double shift_mm = twist.head<3>().cwiseAbs().maxCoeff();
  const double turn_rad = twist.tail<3>().cwiseAbs().maxCoeff();
  if (!twist.allFinite() || shift_mm > options.max_sigmas * options.robot_shift_mm ||
      turn_rad > options.max_sigmas * options.robot_turn_rad) {
    return Fail(ErrorCode::kUntrusted,
                "the view is {:.3f} mm and {:.0f} urad off where it was taught, more than {} times what the "
                "robot scatters: a knock, or what stood still was moved",
                shift_mm, 1e6 * turn_rad, options.max_sigmas);
  }
  const PatchResidual worst = WorstPatch(matches, twist, options);
  if (worst.sigmas > options.max_patch_sigmas && worst.distance_mm > options.max_patch_mm) {
    return Fail(
        ErrorCode::kUntrusted,
        "a piece of what stood still lies {:.3f} mm ({:.0f} sigma) off where the rest of it is, at most {} "
        "mm or {} sigma: it was moved, or grew warm",
        worst.distance_mm, worst.sigmas, options.max_patch_mm, options.max_patch_sigmas);
  }
  return {};
}

Eigen::Vector3d MiddleOf(const PointCloud& cloud) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  std::size_t count = 0;
  for (const Eigen::Vector3f& p : cloud.points) {
    if (!p.allFinite()) continue;
    sum += p.cast<double>();
    ++count;
  }
  return sum / static_cast<double>(std::max<std::size_t>(1, count));
}

}  // namespace

Result<VisitError> EstimateVisitError(std::span<const SurfaceCell> standing,
                                      const PointCloud& cloud_in_camera, const VisitErrorOptions& options) {
  const Eigen::Vector3d pivot = MiddleOf(cloud_in_camera);
  const Matches matches = Join(standing, SurfaceCells(cloud_in_camera, options.cells), pivot, options);
  if (matches.near.size() + matches.far < options.min_cells) {
    VisitError unknown;
    unknown.standard = RobotAlone(options);
    unknown.cells = matches.near.size();
    return unknown;
  }
  if (matches.far > matches.near.size()) {
    return Fail(ErrorCode::kUntrusted,
                "of what stood still {} places are more than {} mm off, {} are not: a knock, or it was moved",
                matches.far, options.max_distance_mm, matches.near.size());
  }
  Vector6 twist = Vector6::Zero();
  for (int step = 0; step < kSteps; ++step) {
    const System system = Build(matches.near, twist, options);
    twist = SolvePositive(system.information, system.right_side);
  }
  RETURN_IF_ERROR(CheckMotion(matches.near, twist, options));
  const Matrix6 covariance = InverseOf(Build(matches.near, twist, options).information);
  return VisitError{MotionOf(twist, pivot), twist.head<3>().norm(), covariance.diagonal().cwiseSqrt(),
                    matches.near.size()};
}

}  // namespace forgescan
