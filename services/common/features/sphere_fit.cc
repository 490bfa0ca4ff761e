#include "services/common/features/sphere_fit.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "services/common/geometry/dense_solvers.h"

namespace forgescan {
namespace {

using Points = std::span<const Eigen::Vector3d>;

constexpr std::size_t kCapPoints = 16384;  // tell the opening of the cap
constexpr double kCapTail = 0.02;          // of the points
constexpr double kFlatShare =
    1e-9;  // weakest eigenvalue of the mean normal matrix: below, the cap is a plane

// |p|^2 = 2 c.p + (r^2 - |c|^2), linear in c and the rest; about the centroid for the digits.
Result<SphereFit> AlgebraicStart(Points points) {
  Eigen::Vector3d centroid = Eigen::Vector3d::Zero();
  for (const Eigen::Vector3d& p : points) centroid += p;
  centroid /= static_cast<double>(points.size());
  Eigen::Matrix4d normal = Eigen::Matrix4d::Zero();
  Eigen::Vector4d right = Eigen::Vector4d::Zero();
  for (const Eigen::Vector3d& p : points) {
    const Eigen::Vector3d q = p - centroid;
    const Eigen::Vector4d row(2 * q.x(), 2 * q.y(), 2 * q.z(), 1);
    normal += row * row.transpose();
    right += row * q.squaredNorm();
  }
  const Eigen::Vector4d x = SolvePositive(normal, right);
  SphereFit sphere;
  sphere.center = centroid + x.head<3>();
  sphere.radius_mm = std::sqrt(x[3] + x.head<3>().squaredNorm());
  if (x.allFinite() && sphere.radius_mm > 0) return sphere;
  return Fail(ErrorCode::kDegenerate, "{} points do not fix a sphere: they lie in a plane", points.size());
}

// A sphere on its way to the least-squares one.
class SphereModel {
 public:
  static constexpr int kUnknowns = SphereSums::kUnknowns;
  static constexpr const char* kName = "sphere";

  explicit SphereModel(const SphereFit& start) : fit_(start) {}

  const SphereFit& fit() const { return fit_; }
  double SizeMm() const { return fit_.radius_mm; }
  NormalSums<4> Sum(Points points, double limit_mm) const {
    return SumRows(points, {fit_.center}, SphereSums{fit_.radius_mm}, limit_mm);
  }
  std::vector<float> Residuals(Points points) const {
    return AbsoluteResiduals(points, {fit_.center}, SphereSums{fit_.radius_mm});
  }

  Result<double> Move(const NormalSums<4>& sums) {
    if (sums.used < 4) return Fail(ErrorCode::kDegenerate, "fewer than 4 points are left for a sphere");
    const Eigen::Vector4d eigenvalues = EigenvaluesOf(sums.normal);
    if (!(eigenvalues[0] > kFlatShare * eigenvalues[3])) {
      return Fail(ErrorCode::kDegenerate, "{} points do not fix a sphere: the cap is too flat", sums.used);
    }
    fit_.covariance = sums.normal.inverse();
    const Eigen::Vector4d move = fit_.covariance * sums.right;
    fit_.center += move.head<3>();
    fit_.radius_mm += move[3];
    if (fit_.radius_mm > 0) return sums.right.dot(move);
    return Fail(ErrorCode::kNotConverged, "no sphere through {} points: its radius fell below 0", sums.used);
  }

 private:
  SphereFit fit_;
};

// Half the opening of the cap that holds the points, seen from the centre. The last kCapTail of them do not
// count: a few stray points must not make a cap look wider than the points that fix its radius.
double HalfCapRad(Points points, const SphereFit& sphere) {
  std::vector<Eigen::Vector3d> directions;
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (const Eigen::Vector3d& p : points) {
    if (std::abs(sphere.Residual(p)) > sphere.quality.limit_mm) continue;
    directions.push_back((p - sphere.center).normalized());
    sum += directions.back();
  }
  const Eigen::Vector3d middle =
      sum.normalized();  // of a full sphere: any direction, the opening is the same
  std::vector<double> angles;
  for (const Eigen::Vector3d& d : directions)
    angles.push_back(std::atan2(d.cross(middle).norm(), d.dot(middle)));
  const auto last = static_cast<std::ptrdiff_t>((1 - kCapTail) * static_cast<double>(angles.size()));
  std::nth_element(angles.begin(), angles.begin() + last, angles.end());
  return angles[static_cast<std::size_t>(last)];
}

Status CheckCap(Points points, const SphereFit& sphere) {
  const double half_rad = HalfCapRad(EvenSample(points, kCapPoints), sphere);
  return CheckSagitta(sphere.quality, sphere.radius_mm, half_rad, "sphere");
}

}  // namespace

Result<SphereFit> FitSphere(std::span<const Eigen::Vector3d> points, const RobustOptions& options) {
  constexpr std::size_t kUnknowns = SphereSums::kUnknowns;
  RETURN_IF_ERROR(CheckCount(points, std::max(kUnknowns, options.min_points), "sphere"));
  const auto start = AlgebraicStart(EvenSample(points, kStartPoints));
  if (!start.ok()) {
    RETURN_IF_ERROR(CheckFinite(points));
    return start.error();
  }
  SphereModel model(*start);
  ASSIGN_OR_RETURN(const FitQuality quality, FitRobust(points, options, model));
  SphereFit sphere = model.fit();
  sphere.quality = quality;
  RETURN_IF_ERROR(CheckForm(sphere.quality, sphere.radius_mm, options, "sphere"));
  RETURN_IF_ERROR(CheckCap(points, sphere));
  sphere.covariance *= sphere.quality.sigma_mm * sphere.quality.sigma_mm;
  return sphere;
}

}  // namespace forgescan
