#include "services/common/features/cylinder_fit.h"

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <numbers>

namespace forgescan {
namespace {

constexpr double kMaxAxisUncertainty_deg = 0.3;  // standard uncertainty
using Matrix5 = Eigen::Matrix<double, 5, 5>;
using Vector5 = Eigen::Matrix<double, 5, 1>;
using Points = std::span<const Eigen::Vector3d>;

constexpr int kMaxSteps = 60;
constexpr double kStopShare = 1e-9;  // of the radius
constexpr double kWeakShare =
    1e-8;  // smallest eigenvalue against the largest: below, the points do not fix a cylinder
constexpr int kDirections = 400;  // tried on the half sphere when there is no start: about 7 degrees apart
constexpr std::size_t kTrialPoints = 500;
constexpr int kCandidates = 5;  // best directions that are refined
constexpr int kArcBins = 720;
constexpr double kFullTurnDeg = 360;
constexpr double kCoreShare =
    0.1;  // of the mean count of the filled bins: a bin with fewer holds only strays
constexpr double kLeastArcDeg = 10;  // for a radius: below, noise decides whether it is a cylinder or a plane

struct System {
  Matrix5 normal = Matrix5::Zero();
  Vector5 right = Vector5::Zero();
};

// Length the tilt is scaled with, so that all unknowns are mm of about the same effect.
double HalfLength(Points points, const CylinderFit& c) {
  double squares = 0;
  for (const Eigen::Vector3d& p : points) squares += std::pow((p - c.axis_point).dot(c.axis), 2);
  return std::max(std::sqrt(squares / static_cast<double>(points.size())), 1e-6);
}

System Accumulate(Points points, const CylinderFit& c, const Eigen::Matrix<double, 3, 2>& across,
                  double half_length) {
  System sum;
  for (const Eigen::Vector3d& p : points) {
    const Eigen::Vector3d q = p - c.axis_point;
    const double along = q.dot(c.axis);
    const Eigen::Vector3d radial = q - along * c.axis;
    const double distance = radial.norm();
    if (!(distance > 0)) continue;
    const Eigen::Vector2d unit = across.transpose() * radial / distance;
    Vector5 row;
    row << unit, along / half_length * unit, c.radius_constrained ? 0.0 : 1.0;
    sum.normal.noalias() += row * row.transpose();
    sum.right += row * (distance - c.radius_mm);
  }
  if (c.radius_constrained) sum.normal(4, 4) = static_cast<double>(points.size());
  return sum;
}

// Moves the axis point beside the centroid, where position and tilt are least entangled.
void Recenter(Points points, CylinderFit& c) {
  Eigen::Vector3d centroid = Eigen::Vector3d::Zero();
  for (const Eigen::Vector3d& p : points) centroid += p;
  centroid /= static_cast<double>(points.size());
  c.axis_point += (centroid - c.axis_point).dot(c.axis) * c.axis;
}

Result<CylinderFit> GaussNewton(Points points, CylinderFit c) {
  if (points.size() < 5)
    return Fail(ErrorCode::kDegenerate, "{} points are left, a cylinder needs 5", points.size());
  Recenter(points, c);
  const double half_length = HalfLength(points, c);
  for (int step = 0; step < kMaxSteps; ++step) {
    Eigen::Matrix<double, 3, 2> across;
    across.col(0) = c.axis.unitOrthogonal();
    across.col(1) = c.axis.cross(across.col(0));
    const System sum = Accumulate(points, c, across, half_length);
    const Eigen::SelfAdjointEigenSolver<Matrix5> eigen(sum.normal, Eigen::EigenvaluesOnly);
    if (!(eigen.eigenvalues()[0] > kWeakShare * eigen.eigenvalues()[4])) break;
    Vector5 scale;
    scale << 1, 1, 1 / half_length, 1 / half_length, 1;
    const Matrix5 inverse = sum.normal.inverse();
    const Vector5 move = inverse * sum.right;
    c.axis_point += across * move.head<2>();
    c.axis = (c.axis + across * move.segment<2>(2) / half_length).normalized();
    c.radius_mm += move[4];
    c.covariance = scale.asDiagonal() * inverse * scale.asDiagonal();
    if (c.radius_constrained) c.covariance(4, 4) = 0;
    if (!(c.radius_mm > 0) || !move.allFinite()) break;
    if (move.norm() < kStopShare * c.radius_mm) return c;
  }
  return Fail(ErrorCode::kNotConverged,
              "no cylinder through the {} points: they do not fix axis and radius, or are of "
              "another shape",
              points.size());
}

// Algebraic circle of the points seen along `axis`; radius 0 if they have none.
CylinderFit CircleAlong(Points points, const Eigen::Vector3d& axis) {
  CylinderFit c;
  c.axis = axis;
  Eigen::Vector3d centroid = Eigen::Vector3d::Zero();
  for (const Eigen::Vector3d& p : points) centroid += p;
  centroid /= static_cast<double>(points.size());
  const Eigen::Vector3d u = axis.unitOrthogonal(), v = axis.cross(u);
  Eigen::Matrix3d normal = Eigen::Matrix3d::Zero();
  Eigen::Vector3d right = Eigen::Vector3d::Zero();
  for (const Eigen::Vector3d& p : points) {
    const double x = u.dot(p - centroid), y = v.dot(p - centroid);
    const Eigen::Vector3d row(2 * x, 2 * y, 1);
    normal += row * row.transpose();
    right += row * (x * x + y * y);
  }
  const Eigen::Vector3d s = normal.inverse() * right;
  const double squared = s[2] + s[0] * s[0] + s[1] * s[1];
  if (!s.allFinite() || !(squared > 0)) return c;
  c.axis_point = centroid + s[0] * u + s[1] * v;
  c.radius_mm = std::sqrt(squared);
  return c;
}

double MedianResidual(Points points, const CylinderFit& c) {
  std::vector<double> residuals;
  for (const Eigen::Vector3d& p : points) residuals.push_back(std::abs(c.Residual(p)));
  return RejectionLimit(residuals, 1);
}

std::vector<Eigen::Vector3d> EvenSample(Points points) {
  const std::size_t step = std::max<std::size_t>(1, points.size() / kTrialPoints);
  std::vector<Eigen::Vector3d> sample;
  for (std::size_t i = 0; i < points.size(); i += step) sample.push_back(points[i]);
  return sample;
}

// Directions on a spiral over the half sphere.
Eigen::Vector3d TrialDirection(int i) {
  const double z = (i + 0.5) / kDirections;
  const double angle = i * std::numbers::pi * (3 - std::sqrt(5.0));
  const double across = std::sqrt(1 - z * z);
  return {across * std::cos(angle), across * std::sin(angle), z};
}

Result<CylinderFit> SearchStart(Points points) {
  const std::vector<Eigen::Vector3d> sample = EvenSample(points);
  std::vector<std::pair<double, int>> ranking;
  for (int i = 0; i < kDirections; ++i) {
    const CylinderFit c = CircleAlong(sample, TrialDirection(i));
    if (c.radius_mm > 0) ranking.emplace_back(MedianResidual(sample, c), i);
  }
  std::sort(ranking.begin(), ranking.end());
  std::optional<CylinderFit> best;
  double best_residual = 0;
  for (std::size_t i = 0; i < std::min<std::size_t>(kCandidates, ranking.size()); ++i) {
    const auto refined = GaussNewton(sample, CircleAlong(sample, TrialDirection(ranking[i].second)));
    if (!refined.ok()) continue;
    const double residual = MedianResidual(sample, *refined);
    if (best && residual >= best_residual) continue;
    best = *refined;
    best_residual = residual;
  }
  if (best) return *best;
  return Fail(ErrorCode::kDegenerate, "no cylinder through the {} points from any direction", points.size());
}

// Points used in each of kArcBins directions about the axis.
std::array<std::size_t, kArcBins> CountDirections(Points points, const CylinderFit& c, double limit_mm) {
  std::array<std::size_t, kArcBins> counts{};
  const Eigen::Vector3d u = c.axis.unitOrthogonal(), v = c.axis.cross(u);
  for (const Eigen::Vector3d& p : points) {
    if (std::abs(c.Residual(p)) > limit_mm) continue;
    const double turn =
        std::atan2(v.dot(p - c.axis_point), u.dot(p - c.axis_point)) / (2 * std::numbers::pi) + 0.5;
    ++counts[static_cast<std::size_t>(turn * kArcBins) % kArcBins];
  }
  return counts;
}

double ArcDeg(Points points, const CylinderFit& c, double reject_sigmas) {
  std::vector<double> residuals;
  for (const Eigen::Vector3d& p : points) residuals.push_back(std::abs(c.Residual(p)));
  const auto counts = CountDirections(points, c, RejectionLimit(residuals, reject_sigmas));
  std::size_t filled = 0, used = 0;
  for (const std::size_t count : counts) {
    filled += count > 0 ? 1U : 0U;
    used += count;
  }
  const double least =
      kCoreShare * static_cast<double>(used) / static_cast<double>(std::max<std::size_t>(filled, 1));
  int gap = 0, largest = 0;
  for (int i = 0; i < 2 * kArcBins; ++i) {
    const std::size_t count = counts[static_cast<std::size_t>(i % kArcBins)];
    gap = count > 0 && static_cast<double>(count) >= least ? 0 : gap + 1;
    largest = std::max(largest, std::min(gap, kArcBins));
  }
  return kFullTurnDeg * (kArcBins - largest) / kArcBins;
}

// Whether what is seen of the cylinder fixes its radius.
Status CheckArc(const CylinderFit& c) {
  if (c.radius_constrained) return {};
  if (c.arc_deg < kLeastArcDeg) {
    return Fail(ErrorCode::kDegenerate,
                "the points cover an arc of {:.1f} degrees, a radius needs at least {}", c.arc_deg,
                kLeastArcDeg);
  }
  return CheckSagitta(c.quality, c.radius_mm, c.arc_deg / kFullTurnDeg * std::numbers::pi, "cylinder");
}

Result<CylinderFit> FromStart(Points points, const std::optional<CylinderStart>& start) {
  if (!start) return SearchStart(points);
  const double length = start->axis.norm();
  if (!start->axis_point.allFinite() || !(length > 0) || !std::isfinite(length) || !(start->radius_mm > 0)) {
    return Fail(ErrorCode::kInvalidArgument,
                "the cylinder to start from needs a finite point, a direction and a radius > 0");
  }
  CylinderFit c;
  c.axis_point = start->axis_point;
  c.axis = start->axis / length;
  c.radius_mm = start->radius_mm;
  c.radius_constrained = start->keep_radius;
  return c;
}

Status CheckAxis(const CylinderFit& cylinder) {
  const double uncertainty_deg = cylinder.AxisUncertaintyRad() * 180 / std::numbers::pi;
  if (uncertainty_deg > kMaxAxisUncertainty_deg) {
    return Fail(
        ErrorCode::kDegenerate,
        "the points do not fix the cylinder's axis: its direction is uncertain by {:.1f} deg, limit {}",
        uncertainty_deg, kMaxAxisUncertainty_deg);
  }
  return {};
}

}  // namespace

Result<CylinderFit> FitCylinder(std::span<const Eigen::Vector3d> points,
                                const std::optional<CylinderStart>& start, const RobustOptions& options) {
  constexpr std::size_t kUnknowns = 5;
  RETURN_IF_ERROR(CheckPoints(points, std::max(kUnknowns, options.min_points), "cylinder"));
  ASSIGN_OR_RETURN(const CylinderFit first, FromStart(points, start));
  const auto fit = [&](const std::vector<Eigen::Vector3d>& used, const CylinderFit* before) {
    return GaussNewton(used, before != nullptr ? *before : first);
  };
  ASSIGN_OR_RETURN(CylinderFit cylinder, FitRobust<CylinderFit>(points, options, fit));
  RETURN_IF_ERROR(CheckForm(cylinder.quality, cylinder.radius_mm, options, "cylinder"));
  cylinder.arc_deg = ArcDeg(points, cylinder, options.reject_sigmas);
  RETURN_IF_ERROR(CheckArc(cylinder));
  Eigen::Index largest = 0;
  cylinder.axis.cwiseAbs().maxCoeff(&largest);
  if (cylinder.axis[largest] < 0) cylinder.axis = -cylinder.axis;
  cylinder.covariance *= cylinder.quality.sigma_mm * cylinder.quality.sigma_mm;
  RETURN_IF_ERROR(CheckAxis(cylinder));
  return cylinder;
}

}  // namespace forgescan
