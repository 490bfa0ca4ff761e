#include "services/common/features/cone_fit.h"

#include <Eigen/Geometry>
#include <numbers>

#include "services/common/geometry/dense_solvers.h"

namespace forgescan {
namespace {

using Points = std::span<const Eigen::Vector3d>;
using Matrix6 = Eigen::Matrix<double, 6, 6>;
using Vector6 = Eigen::Matrix<double, 6, 1>;

// Smallest eigenvalue against the largest: below, the points do not fix a cone. Larger than a cylinder's:
// with the sixth unknown a short arc is nearly free long before rounding shows it.
constexpr double kWeakShare = 1e-7;

// A cone on its way to the least-squares one.
class ConeModel {
 public:
  static constexpr int kUnknowns = ConeSums::kUnknowns;
  static constexpr const char* kName = "cone";

  ConeModel(Points points, const ConeFit& start) : fit_(start) {
    Eigen::Vector3d centroid = Eigen::Vector3d::Zero();
    for (const Eigen::Vector3d& p : points) centroid += p;
    centroid /= static_cast<double>(points.size());
    Slide((centroid - fit_.axis_point).dot(fit_.axis));
    double squares = 0;
    for (const Eigen::Vector3d& p : points) squares += std::pow((p - fit_.axis_point).dot(fit_.axis), 2);
    half_length_mm_ = std::max(std::sqrt(squares / static_cast<double>(points.size())), 1e-6);
  }

  const ConeFit& fit() const { return fit_; }
  double SizeMm() const { return std::abs(fit_.radius_mm); }
  NormalSums<6> Sum(Points points, double limit_mm) const {
    return SumRows(points, Frame(), Shape(), limit_mm);
  }
  std::vector<float> Residuals(Points points) const { return AbsoluteResiduals(points, Frame(), Shape()); }

  Result<double> Move(const NormalSums<6>& sums) {
    if (sums.used < 6) return Fail(ErrorCode::kDegenerate, "{} points are left, a cone needs 6", sums.used);
    const Vector6 eigenvalues = EigenvaluesOf(sums.normal);
    if (!(eigenvalues[0] > kWeakShare * eigenvalues[5])) return NoCone(sums.used);
    const Eigen::Matrix3d axes = Frame().axes;
    const Matrix6 inverse = InverseOf(sums.normal);
    const Vector6 move = inverse * sums.right;
    fit_.axis_point += axes.leftCols<2>() * move.head<2>();
    fit_.axis = (fit_.axis + axes.leftCols<2>() * move.segment<2>(2) / half_length_mm_).normalized();
    fit_.radius_mm += move[4];
    fit_.half_angle_rad += move[5] / half_length_mm_;
    if (!move.allFinite() || !(std::abs(fit_.half_angle_rad) < std::numbers::pi / 2))
      return NoCone(sums.used);
    Slide(sums.along / static_cast<double>(sums.used));
    if (!(fit_.radius_mm > 0)) return NoCone(sums.used);
    Vector6 scale;
    scale << 1, 1, 1 / half_length_mm_, 1 / half_length_mm_, 1, 1 / half_length_mm_;
    fit_.covariance = scale.asDiagonal() * inverse * scale.asDiagonal();
    return sums.right.dot(move);
  }

 private:
  static Error NoCone(std::size_t used) {
    return Fail(
        ErrorCode::kNotConverged,
        "no cone through the {} points: they do not fix axis, radius and angle, or are of another shape",
        used);
  }
  void Slide(double along_mm) {
    fit_.axis_point += along_mm * fit_.axis;
    fit_.radius_mm += along_mm * std::tan(fit_.half_angle_rad);
  }
  FitFrame Frame() const {
    FitFrame frame{fit_.axis_point, {}};
    const Eigen::Vector3d u = fit_.axis.unitOrthogonal();
    frame.axes << u, fit_.axis.cross(u), fit_.axis;
    return frame;
  }
  ConeSums Shape() const {
    return {fit_.radius_mm, std::cos(fit_.half_angle_rad), std::sin(fit_.half_angle_rad),
            1 / half_length_mm_};
  }

  ConeFit fit_;
  double half_length_mm_ = 1;
};

Result<ConeFit> FromStart(const ConeStart& start) {
  const double length = start.axis.norm();
  if (!start.axis_point.allFinite() || !(length > 0) || !std::isfinite(length) || !(start.radius_mm > 0) ||
      !(std::abs(start.half_angle_rad) < std::numbers::pi / 2)) {
    return Fail(
        ErrorCode::kInvalidArgument,
        "the cone to start from needs a finite point, a direction, a radius > 0 and a half angle below "
        "a quarter turn");
  }
  ConeFit cone;
  cone.axis_point = start.axis_point;
  cone.axis = start.axis / length;
  cone.radius_mm = start.radius_mm;
  cone.half_angle_rad = start.half_angle_rad;
  return cone;
}

}  // namespace

Result<ConeFit> FitCone(std::span<const Eigen::Vector3d> points, const ConeStart& start,
                        const RobustOptions& options) {
  constexpr std::size_t kUnknowns = ConeSums::kUnknowns;
  RETURN_IF_ERROR(CheckCount(points, std::max(kUnknowns, options.min_points), "cone"));
  ASSIGN_OR_RETURN(const ConeFit first, FromStart(start));
  ConeModel model(EvenSample(points, kStartPoints), first);
  ASSIGN_OR_RETURN(const FitQuality quality, FitRobust(points, options, model));
  ConeFit cone = model.fit();
  cone.quality = quality;
  RETURN_IF_ERROR(CheckForm(cone.quality, cone.radius_mm, options, "cone"));
  cone.covariance *= quality.sigma_mm * quality.sigma_mm;
  if (cone.half_angle_rad <
      0) {  // the other way round; what belongs to the tilt and the angle turns its sign
    cone.axis = -cone.axis;
    cone.half_angle_rad = -cone.half_angle_rad;
    Vector6 sign;
    sign << 1, 1, -1, -1, 1, -1;
    cone.covariance = sign.asDiagonal() * cone.covariance * sign.asDiagonal();
  }
  return cone;
}

}  // namespace forgescan
