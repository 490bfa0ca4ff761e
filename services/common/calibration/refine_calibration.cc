#include "services/common/calibration/refine_calibration.h"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

#include "services/common/calibration/remeasured_bars.h"
#include "services/common/calibration/rig_geometry.h"

namespace forgescan {
namespace {

// The corrections over their prior standard deviations, and last the certificate's over its own.
constexpr int kUnknowns = kRigParameters + 1;
using Unknowns = Eigen::Matrix<double, kUnknowns, 1>;
using UnknownsMatrix = Eigen::Matrix<double, kUnknowns, kUnknowns>;

struct Problem {
  const StereoCalibration& present;
  const BallBar& bar;
  RigVector prior_sd;
  RemeasuredBars bars;
  Eigen::VectorXd sigma_mm;  // of a distance, by placement

  // Measured less certified distances over their sigma.
  Eigen::VectorXd Residuals(const Unknowns& x) const {
    const RigVector correction = prior_sd.cwiseProduct(x.head<kRigParameters>());
    const Eigen::VectorXd distance_mm = bars.DistancesBy(Corrected(present, correction));
    const double certified_mm = bar.distance_mm + bar.distance_sigma_mm * x(kRigParameters);
    return (distance_mm.array() - certified_mm) / sigma_mm.array();
  }
};

struct Solution {
  Unknowns x = Unknowns::Zero();
  UnknownsMatrix covariance;
  Eigen::MatrixXd jacobian;
  Eigen::VectorXd residuals;
};

Eigen::MatrixXd Jacobian(const Problem& problem, const Unknowns& x) {
  Eigen::MatrixXd jacobian(problem.sigma_mm.size(), kUnknowns);
  for (int i = 0; i < kUnknowns; ++i) {
    const Unknowns step = 0.5 * Unknowns::Unit(i);
    jacobian.col(i) = problem.Residuals(x + step) - problem.Residuals(x - step);
  }
  return jacobian;
}

Result<Solution> Solve(const Problem& problem) {
  constexpr int kMaxSteps = 20;
  constexpr double kSettled = 1e-6;  // of the prior's standard deviations
  Solution solution;
  for (int step = 0; step < kMaxSteps; ++step) {
    solution.residuals = problem.Residuals(solution.x);
    solution.jacobian = Jacobian(problem, solution.x);
    const Eigen::MatrixXd& j = solution.jacobian;
    solution.covariance = UnknownsMatrix(j.transpose() * j + UnknownsMatrix::Identity()).inverse();
    const Unknowns x = solution.covariance * (j.transpose() * (j * solution.x - solution.residuals));
    const double moved = (x - solution.x).cwiseAbs().maxCoeff();
    if (!std::isfinite(moved)) break;
    solution.x = x;
    if (moved < kSettled) return solution;
  }
  return Fail(ErrorCode::kNotConverged, "the refinement of the calibration does not settle in {} steps",
              kMaxSteps);
}

// A placement's errors in a refinement without it, by its share in its own prediction (leverage, below 1).
void SetLeftOut(const Problem& problem, const Solution& solution, Eigen::Index at, PlacementErrors& errors) {
  const Unknowns gain = solution.covariance * solution.jacobian.row(at).transpose();
  const double others = 1 - solution.jacobian.row(at).dot(gain);
  const double misfit = solution.residuals(at) / others;
  const double from_certificate = gain(kRigParameters);
  const double correction = solution.x(kRigParameters) + from_certificate * misfit;
  const double variance =
      solution.covariance(kRigParameters, kRigParameters) + from_certificate * from_certificate / others;
  const double sigma_mm = problem.sigma_mm(at), certificate_mm = problem.bar.distance_sigma_mm;
  errors.left_out_mm = misfit * sigma_mm + correction * certificate_mm;
  errors.left_out_sigma_mm =
      std::hypot(sigma_mm / std::sqrt(others), certificate_mm * std::sqrt(std::max(0.0, 1 - variance)));
  errors.misfit_sigmas = misfit * std::sqrt(others);
}

std::vector<PlacementErrors> ErrorsOf(std::span<const BarPlacement> placements, const Problem& problem,
                                      const Solution& solution) {
  const Eigen::VectorXd before = problem.Residuals(Unknowns::Zero());
  Unknowns certified_kept = solution.x;
  certified_kept(kRigParameters) = 0;
  const Eigen::VectorXd after = problem.Residuals(certified_kept);
  std::vector<PlacementErrors> errors;
  for (std::size_t i = 0; i < placements.size(); ++i) {
    const auto at = static_cast<Eigen::Index>(i);
    PlacementErrors of_placement;
    of_placement.name = placements[i].name;
    of_placement.before_mm = before(at) * problem.sigma_mm(at);
    of_placement.after_mm = after(at) * problem.sigma_mm(at);
    SetLeftOut(problem, solution, at, of_placement);
    errors.push_back(of_placement);
  }
  return errors;
}

Status CheckMisfit(const std::vector<PlacementErrors>& errors, const Solution& solution, double max_sigmas) {
  const auto worst = std::max_element(errors.begin(), errors.end(), [](const auto& a, const auto& b) {
    return std::abs(a.misfit_sigmas) < std::abs(b.misfit_sigmas);
  });
  if (std::abs(worst->misfit_sigmas) > max_sigmas) {
    return Fail(ErrorCode::kUntrusted,
                "placement {} does not fit the others: {:.1f} standard deviations off what they predict, "
                "allowed {}; refined without it, it is {:+.4f} mm off the certificate",
                worst->name, std::abs(worst->misfit_sigmas), max_sigmas, worst->left_out_mm);
  }
  constexpr double kChiSquareSigmas = 4;
  const auto count = static_cast<double>(errors.size());
  const double chi_square = solution.residuals.squaredNorm() + solution.x.squaredNorm();
  const double limit = count + kChiSquareSigmas * std::sqrt(2 * count);
  if (chi_square <= limit) return {};
  return Fail(ErrorCode::kUntrusted,
              "the placements scatter more than their standard deviations and the prior allow: chi-square is "
              "{:.1f} with {} placements, allowed {:.1f}",
              chi_square, errors.size(), limit);
}

Status CheckCorrections(const Unknowns& x, const RigVector& prior_sd, double max_sigmas) {
  for (int i = 0; i < kRigParameters; ++i) {
    if (std::abs(x(i)) <= max_sigmas) continue;
    const RigParameter& parameter = RigParameters().at(static_cast<std::size_t>(i));
    return Fail(ErrorCode::kUntrusted,
                "{} would be corrected by {:+.3g} {}, {:.1f} of its prior standard deviations, allowed {}: "
                "calibrate anew",
                parameter.name, x(i) * prior_sd(i), parameter.unit, std::abs(x(i)), max_sigmas);
  }
  if (std::abs(x(kRigParameters)) <= max_sigmas) return {};
  return Fail(ErrorCode::kUntrusted,
              "the certified distance would be off by {:.1f} of its uncertainties, allowed {}",
              std::abs(x(kRigParameters)), max_sigmas);
}

// Points on a grid over the box of the centres.
std::vector<Eigen::Vector3d> VolumeOf(std::span<const BarPlacement> placements) {
  constexpr int kSteps = 4;
  Eigen::AlignedBox3d box;
  for (const BarPlacement& placement : placements) {
    for (const Eigen::Vector3d& center : placement.center_in_camera) box.extend(center);
  }
  std::vector<Eigen::Vector3d> points;
  for (int i = 0; i <= kSteps; ++i) {
    for (int j = 0; j <= kSteps; ++j) {
      for (int k = 0; k <= kSteps; ++k) {
        points.emplace_back(box.min() + box.sizes().cwiseProduct(Eigen::Vector3d(i, j, k)) / kSteps);
      }
    }
  }
  return points;
}

Eigen::Isometry3d NearestMotion(const std::vector<Eigen::Vector3d>& from,
                                const std::vector<Eigen::Vector3d>& to) {
  const auto count = std::ssize(from);
  const Eigen::Map<const Eigen::Matrix3Xd> a(from.front().data(), 3, count), b(to.front().data(), 3, count);
  Eigen::Isometry3d motion;
  motion.matrix() = Eigen::umeyama(a, b, false);
  return motion;
}

void SetParameters(const Solution& solution, const Problem& problem, CalibrationRefinement& refinement) {
  const RigMatrix share = solution.covariance.topLeftCorner<kRigParameters, kRigParameters>();
  refinement.correction = problem.prior_sd.cwiseProduct(solution.x.head<kRigParameters>());
  refinement.covariance = problem.prior_sd.asDiagonal() * share * problem.prior_sd.asDiagonal();
  refinement.posterior_sigma = refinement.covariance.diagonal().cwiseSqrt();
  constexpr double kTwiceAsWell = 0.25;  // of the prior variance
  const Eigen::SelfAdjointEigenSolver<RigMatrix> directions(share, Eigen::EigenvaluesOnly);
  refinement.determined_directions =
      static_cast<int>((directions.eigenvalues().array() < kTwiceAsWell).count());
  const double certificate_mm = problem.bar.distance_sigma_mm;
  refinement.certificate = {certificate_mm * solution.x(kRigParameters), certificate_mm,
                            certificate_mm * std::sqrt(solution.covariance(kRigParameters, kRigParameters))};
  refinement.calibration = Corrected(problem.present, refinement.correction);
}

}  // namespace

double LargestError(std::span<const PlacementErrors> placements, double PlacementErrors::*error) {
  double largest = 0;
  for (const PlacementErrors& placement : placements) largest = std::max(largest, std::abs(placement.*error));
  return largest;
}

Result<CalibrationRefinement> RefineCalibration(const StereoCalibration& present, const BallBar& bar,
                                                std::span<const BarPlacement> placements,
                                                const RefinementOptions& options) {
  RETURN_IF_ERROR(Check(options.prior));
  RETURN_IF_ERROR(CheckPlacements(bar, placements, present, options.placements));
  Problem problem{present, bar, options.prior.StandardDeviations(),
                  RemeasuredBars(present, placements, bar.ball_radius_mm),
                  Eigen::VectorXd(std::ssize(placements))};
  for (std::size_t i = 0; i < placements.size(); ++i) {
    problem.sigma_mm(static_cast<Eigen::Index>(i)) = std::numbers::sqrt2 * placements[i].center_sigma_mm;
  }
  ASSIGN_OR_RETURN(const Solution solution, Solve(problem));
  CalibrationRefinement refinement;
  refinement.placements = ErrorsOf(placements, problem, solution);
  RETURN_IF_ERROR(CheckMisfit(refinement.placements, solution, options.max_misfit_sigmas));
  RETURN_IF_ERROR(CheckCorrections(solution.x, problem.prior_sd, options.max_prior_sigmas));
  SetParameters(solution, problem, refinement);
  const std::vector<Eigen::Vector3d> volume = VolumeOf(placements);
  refinement.refined_from_present = NearestMotion(
      volume, RigGeometry(refinement.calibration).Triangulated(RigGeometry(present).Seen(volume)));
  if (present.projector) {
    ASSIGN_OR_RETURN(refinement.projector,
                     RefitProjector(present, refinement.calibration, volume, options.prior));
    refinement.calibration.projector = refinement.projector->projector;
  }
  RETURN_IF_ERROR(Check(refinement.calibration));
  return refinement;
}

}  // namespace forgescan
