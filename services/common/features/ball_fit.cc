#include "services/common/features/ball_fit.h"

#include <algorithm>
#include <cmath>

#include "services/common/features/sphere_fit.h"
#include "services/common/geometry/dense_solvers.h"

namespace forgescan {
namespace {

constexpr double kCap = 0.5;    // cosine of 60 degrees: only what faces the camera so far is fitted
constexpr double kReach = 1.4;  // radii about where the ball was put, by hand

// Points of the cap about a centre that face the camera.
std::vector<Eigen::Vector3d> CapOf(const PointCloud& cloud, const BallSearch& ball,
                                   const Eigen::Vector3d& center) {
  const Eigen::Vector3d to_camera = (ball.camera - center).normalized();
  std::vector<Eigen::Vector3d> points;
  for (const Eigen::Vector3f& p : cloud.points) {
    const Eigen::Vector3d out = p.cast<double>() - center;
    const bool is_near = out.norm() < kReach * ball.radius_mm;
    if (is_near && out.dot(to_camera) > kCap * out.norm()) points.push_back(p.cast<double>());
  }
  return points;
}

// The centre of a ball of known radius: a cap of 60 degrees is a quarter of the sphere, too little for a free
// radius, whose error would go into the centre. Gauss-Newton; points beyond 3 sigma (by the median) are left
// out.
Eigen::Vector3d CenterOfKnownBall(const std::vector<Eigen::Vector3d>& points, double radius_mm,
                                  Eigen::Vector3d center) {
  constexpr int kRounds = 8;
  for (int round = 0; round < kRounds; ++round) {
    std::vector<double> sorted;
    for (const Eigen::Vector3d& p : points) sorted.push_back(std::abs((p - center).norm() - radius_mm));
    const auto middle = sorted.begin() + static_cast<std::ptrdiff_t>(sorted.size() / 2);
    std::nth_element(sorted.begin(), middle, sorted.end());
    const double limit_mm = 3 * 1.4826 * *middle;
    Eigen::Matrix3d matrix = Eigen::Matrix3d::Zero();
    Eigen::Vector3d right = Eigen::Vector3d::Zero();
    for (const Eigen::Vector3d& p : points) {
      const Eigen::Vector3d out = (p - center).normalized();
      const double residual_mm = (p - center).norm() - radius_mm;
      if (std::abs(residual_mm) > limit_mm) continue;
      matrix += out * out.transpose();
      right += residual_mm * out;
    }
    center += SolvePositive(matrix, right);
  }
  return center;
}

}  // namespace

Result<FittedBall> FitBall(const PointCloud& cloud, const BallSearch& ball) {
  ASSIGN_OR_RETURN(const SphereFit first, FitSphere(CapOf(cloud, ball, ball.placed), {}));
  const std::vector<Eigen::Vector3d> points = CapOf(cloud, ball, first.center);
  ASSIGN_OR_RETURN(const SphereFit free, FitSphere(points, {}));
  const Eigen::Vector3d center = CenterOfKnownBall(points, ball.radius_mm, free.center);
  if (!center.allFinite()) {
    return Fail(ErrorCode::kDegenerate, "{} points do not determine the centre of a ball of {} mm",
                points.size(), ball.radius_mm);
  }
  return FittedBall{center, free.radius_mm};
}

}  // namespace forgescan
