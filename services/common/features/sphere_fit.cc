#include "services/common/features/sphere_fit.h"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <algorithm>

namespace forgescan {
namespace {

constexpr int kMaxSteps = 50;
constexpr double kStopShare = 1e-9;  // of the radius
constexpr double kCapTail = 0.02;    // of the points
constexpr double kFlatShare =
    1e-9;  // weakest eigenvalue of the mean normal matrix: below, the cap is a plane

// |p|^2 = 2 c.p + (r^2 - |c|^2), linear in c and the rest; about the centroid for the digits.
Result<SphereFit> AlgebraicStart(std::span<const Eigen::Vector3d> points) {
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
  const Eigen::Vector4d x = normal.ldlt().solve(right);
  SphereFit sphere;
  sphere.center = centroid + x.head<3>();
  sphere.radius_mm = std::sqrt(x[3] + x.head<3>().squaredNorm());
  if (x.allFinite() && sphere.radius_mm > 0) return sphere;
  return Fail(ErrorCode::kDegenerate, "{} points do not fix a sphere: they lie in a plane", points.size());
}

Result<SphereFit> GaussNewton(std::span<const Eigen::Vector3d> points, SphereFit sphere) {
  for (int step = 0; step < kMaxSteps; ++step) {
    Eigen::Matrix4d normal = Eigen::Matrix4d::Zero();
    Eigen::Vector4d right = Eigen::Vector4d::Zero();
    for (const Eigen::Vector3d& p : points) {
      const Eigen::Vector3d from_center = p - sphere.center;
      const double distance = from_center.norm();
      if (!(distance > 0)) continue;
      Eigen::Vector4d row;
      row << from_center / distance, 1;
      normal += row * row.transpose();
      right += row * (distance - sphere.radius_mm);
    }
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix4d> eigen(normal);
    if (!(eigen.eigenvalues()[0] > kFlatShare * eigen.eigenvalues()[3])) {
      return Fail(ErrorCode::kDegenerate, "{} points do not fix a sphere: the cap is too flat",
                  points.size());
    }
    sphere.covariance = normal.inverse();
    const Eigen::Vector4d move = sphere.covariance * right;
    sphere.center += move.head<3>();
    sphere.radius_mm += move[3];
    if (!(sphere.radius_mm > 0)) break;
    if (move.norm() < kStopShare * sphere.radius_mm) return sphere;
  }
  return Fail(ErrorCode::kNotConverged, "the sphere through {} points did not settle in {} steps",
              points.size(), kMaxSteps);
}

// Half the opening of the cap that holds the points, seen from the centre. The last kCapTail of them do not
// count: a few stray points must not make a cap look wider than the points that fix its radius.
double HalfCapRad(std::span<const Eigen::Vector3d> points, const SphereFit& sphere, double limit_mm) {
  std::vector<Eigen::Vector3d> directions;
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (const Eigen::Vector3d& p : points) {
    if (std::abs(sphere.Residual(p)) > limit_mm) continue;
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

Status CheckCap(std::span<const Eigen::Vector3d> points, const SphereFit& sphere, double reject_sigmas) {
  std::vector<double> residuals;
  for (const Eigen::Vector3d& p : points) residuals.push_back(std::abs(sphere.Residual(p)));
  const double half_rad = HalfCapRad(points, sphere, RejectionLimit(residuals, reject_sigmas));
  return CheckSagitta(sphere.quality, sphere.radius_mm, half_rad, "sphere");
}

}  // namespace

Result<SphereFit> FitSphere(std::span<const Eigen::Vector3d> points, const RobustOptions& options) {
  constexpr std::size_t kUnknowns = 4;
  RETURN_IF_ERROR(CheckPoints(points, std::max(kUnknowns, options.min_points), "sphere"));
  const auto fit = [](const std::vector<Eigen::Vector3d>& used,
                      const SphereFit* before) -> Result<SphereFit> {
    if (used.size() < kUnknowns)
      return Fail(ErrorCode::kDegenerate, "fewer than 4 points are left for a sphere");
    if (before != nullptr) return GaussNewton(used, *before);
    ASSIGN_OR_RETURN(const SphereFit start, AlgebraicStart(used));
    return GaussNewton(used, start);
  };
  ASSIGN_OR_RETURN(SphereFit sphere, FitRobust<SphereFit>(points, options, fit));
  RETURN_IF_ERROR(CheckForm(sphere.quality, sphere.radius_mm, options, "sphere"));
  RETURN_IF_ERROR(CheckCap(points, sphere, options.reject_sigmas));
  sphere.covariance *= sphere.quality.sigma_mm * sphere.quality.sigma_mm;
  return sphere;
}

}  // namespace forgescan
