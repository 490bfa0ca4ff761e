#include "services/common/features/cylinder_fit.h"

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <numbers>

#include "services/common/geometry/dense_solvers.h"

namespace forgescan {
namespace {

constexpr double kMaxAxisUncertainty_deg = 0.3;  // standard uncertainty
using Matrix5 = Eigen::Matrix<double, 5, 5>;
using Vector5 = Eigen::Matrix<double, 5, 1>;
using Points = std::span<const Eigen::Vector3d>;

constexpr double kWeakShare =
    1e-8;  // smallest eigenvalue against the largest: below, the points do not fix a cylinder
constexpr int kDirections = 400;  // tried on the half sphere when there is no start: about 7 degrees apart
constexpr std::size_t kTrialPoints = 500;
constexpr int kCandidates = 5;             // best directions that are refined
constexpr std::size_t kArcPoints = 16384;  // tell the arc; more would not tell it better
constexpr int kArcBins = 720;
constexpr double kEverything = std::numeric_limits<double>::infinity();
constexpr double kFullTurnDeg = 360;
constexpr double kCoreShare =
    0.1;  // of the mean count of the filled bins: a bin with fewer holds only strays
constexpr double kLeastArcDeg = 10;  // for a radius: below, noise decides whether it is a cylinder or a plane

// A cylinder on its way to the least-squares one.
class CylinderModel {
 public:
  static constexpr int kUnknowns = CylinderSums::kUnknowns;
  static constexpr const char* kName = "cylinder";

  // Tilts are scaled with the half length of the points, so that all unknowns are mm of about the same
  // effect.
  CylinderModel(Points points, const CylinderFit& start) : fit_(start) {
    Eigen::Vector3d centroid = Eigen::Vector3d::Zero();
    for (const Eigen::Vector3d& p : points) centroid += p;
    centroid /= static_cast<double>(points.size());
    // Beside the centroid position and tilt are least entangled.
    fit_.axis_point += (centroid - fit_.axis_point).dot(fit_.axis) * fit_.axis;
    double squares = 0;
    for (const Eigen::Vector3d& p : points) squares += std::pow((p - fit_.axis_point).dot(fit_.axis), 2);
    half_length_mm_ = std::max(std::sqrt(squares / static_cast<double>(points.size())), 1e-6);
  }

  const CylinderFit& fit() const { return fit_; }
  double SizeMm() const { return fit_.radius_mm; }
  NormalSums<5> Sum(Points points, double limit_mm) const {
    NormalSums<5> sums = SumRows(points, Frame(), Shape(), limit_mm);
    for (int i = 0; i < 5; ++i) {
      if (!(i < 4 ? fit_.axis_constrained : fit_.radius_constrained)) continue;
      sums.normal.row(i).setZero();
      sums.normal.col(i).setZero();
      sums.normal(i, i) = static_cast<double>(sums.used);
      sums.right[i] = 0;
    }
    return sums;
  }
  std::vector<float> Residuals(Points points) const { return AbsoluteResiduals(points, Frame(), Shape()); }

  Result<double> Move(const NormalSums<5>& sums) {
    if (sums.used < 5)
      return Fail(ErrorCode::kDegenerate, "{} points are left, a cylinder needs 5", sums.used);
    const Vector5 eigenvalues = EigenvaluesOf(sums.normal);
    if (!(eigenvalues[0] > kWeakShare * eigenvalues[4])) return NoCylinder(sums.used);
    const Eigen::Matrix3d axes = Frame().axes;
    const Matrix5 inverse = InverseOf(sums.normal);
    const Vector5 move = inverse * sums.right;
    fit_.axis_point += axes.leftCols<2>() * move.head<2>();
    fit_.axis = (fit_.axis + axes.leftCols<2>() * move.segment<2>(2) / half_length_mm_).normalized();
    fit_.axis_point += sums.along / static_cast<double>(sums.used) * fit_.axis;
    fit_.radius_mm += move[4];
    if (!(fit_.radius_mm > 0) || !move.allFinite()) return NoCylinder(sums.used);
    Vector5 scale;
    scale << 1, 1, 1 / half_length_mm_, 1 / half_length_mm_, 1;
    fit_.covariance = scale.asDiagonal() * inverse * scale.asDiagonal();
    if (fit_.axis_constrained) fit_.covariance.topLeftCorner<4, 4>().setZero();
    if (fit_.radius_constrained) fit_.covariance(4, 4) = 0;
    return sums.right.dot(move);
  }

 private:
  static Error NoCylinder(std::size_t used) {
    return Fail(ErrorCode::kNotConverged,
                "no cylinder through the {} points: they do not fix axis and radius, or are of "
                "another shape",
                used);
  }
  FitFrame Frame() const {
    FitFrame frame{fit_.axis_point, {}};
    const Eigen::Vector3d u = fit_.axis.unitOrthogonal();
    frame.axes << u, fit_.axis.cross(u), fit_.axis;
    return frame;
  }
  CylinderSums Shape() const { return {fit_.radius_mm, 1 / half_length_mm_}; }

  CylinderFit fit_;
  double half_length_mm_ = 1;
};

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

double MedianResidual(Points points, const CylinderModel& model) {
  return RejectionLimit(model.Residuals(points), 1);
}

// Directions on a spiral over the half sphere.
Eigen::Vector3d TrialDirection(int i) {
  const double z = (i + 0.5) / kDirections;
  const double angle = i * std::numbers::pi * (3 - std::sqrt(5.0));
  const double across = std::sqrt(1 - z * z);
  return {across * std::cos(angle), across * std::sin(angle), z};
}

Result<CylinderFit> SearchStart(Points points) {
  const std::vector<Eigen::Vector3d> sample = EvenSample(points, kTrialPoints);
  std::vector<std::pair<double, int>> ranking;
  for (int i = 0; i < kDirections; ++i) {
    const CylinderFit c = CircleAlong(sample, TrialDirection(i));
    if (c.radius_mm > 0) ranking.emplace_back(MedianResidual(sample, {sample, c}), i);
  }
  std::sort(ranking.begin(), ranking.end());
  std::optional<CylinderFit> best;
  double best_residual = 0;
  for (std::size_t i = 0; i < std::min<std::size_t>(kCandidates, ranking.size()); ++i) {
    CylinderModel refined(sample, CircleAlong(sample, TrialDirection(ranking[i].second)));
    if (!Settle(std::span(sample), kEverything, kEnough, refined).ok()) continue;
    const double residual = MedianResidual(sample, refined);
    if (best && residual >= best_residual) continue;
    best = refined.fit();
    best_residual = residual;
  }
  if (best) return *best;
  RETURN_IF_ERROR(CheckFinite(points));
  return Fail(ErrorCode::kDegenerate, "no cylinder through the {} points from any direction", points.size());
}

// Points used in each of kArcBins directions about the axis.
std::array<std::size_t, kArcBins> CountDirections(Points points, const CylinderFit& c) {
  std::array<std::size_t, kArcBins> counts{};
  const Eigen::Vector3d u = c.axis.unitOrthogonal(), v = c.axis.cross(u);
  for (const Eigen::Vector3d& p : points) {
    if (std::abs(c.Residual(p)) > c.quality.limit_mm) continue;
    const double turn =
        std::atan2(v.dot(p - c.axis_point), u.dot(p - c.axis_point)) / (2 * std::numbers::pi) + 0.5;
    ++counts[static_cast<std::size_t>(turn * kArcBins) % kArcBins];
  }
  return counts;
}

double ArcDeg(Points points, const CylinderFit& c) {
  const auto counts = CountDirections(EvenSample(points, kArcPoints), c);
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
  if (c.radius_constrained || c.axis_constrained) return {};
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
  c.axis_constrained = start->keep_axis;
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
  constexpr std::size_t kUnknowns = CylinderSums::kUnknowns;
  RETURN_IF_ERROR(CheckCount(points, std::max(kUnknowns, options.min_points), "cylinder"));
  ASSIGN_OR_RETURN(const CylinderFit first, FromStart(points, start));
  CylinderModel model(EvenSample(points, kStartPoints), first);
  ASSIGN_OR_RETURN(const FitQuality quality, FitRobust(points, options, model));
  CylinderFit cylinder = model.fit();
  cylinder.quality = quality;
  RETURN_IF_ERROR(CheckForm(cylinder.quality, cylinder.radius_mm, options, "cylinder"));
  cylinder.arc_deg = ArcDeg(points, cylinder);
  RETURN_IF_ERROR(CheckArc(cylinder));
  Eigen::Index largest = 0;
  cylinder.axis.cwiseAbs().maxCoeff(&largest);
  if (cylinder.axis[largest] < 0) cylinder.axis = -cylinder.axis;
  cylinder.covariance *= cylinder.quality.sigma_mm * cylinder.quality.sigma_mm;
  RETURN_IF_ERROR(CheckAxis(cylinder));
  return cylinder;
}

}  // namespace forgescan
