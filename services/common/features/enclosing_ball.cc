#include "services/common/features/enclosing_ball.h"

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>
#include <vector>

namespace forgescan {
namespace {

using Points = std::span<const Eigen::Vector3d>;

constexpr double kOutsideShare = 1e-12;  // of the squared radius: beyond, a point is outside the ball
constexpr std::uint64_t kShuffleSeed = 1;
constexpr double kWidestHalfAngle_rad = 80 * std::numbers::pi / 180;
constexpr int kMaxTurns = 200;
constexpr double kSettled_rad = 1e-15;

struct Ball {
  Eigen::Vector3d center = Eigen::Vector3d::Zero();
  double squared_radius = -1;  // below 0: holds nothing

  bool Holds(const Eigen::Vector3d& p) const {
    return squared_radius >= 0 && (p - center).squaredNorm() <= squared_radius * (1 + kOutsideShare);
  }
};

// The smallest ball with all of `support` on its surface: its centre lies in their affine hull.
Ball BallThrough(const std::vector<Eigen::Vector3d>& support) {
  if (support.empty()) return {};
  if (support.size() == 1) return {support[0], 0};
  const auto n = static_cast<Eigen::Index>(support.size() - 1);
  Eigen::Matrix<double, 3, Eigen::Dynamic, 0, 3, 3> arms(3, n);
  for (Eigen::Index i = 0; i < n; ++i) arms.col(i) = support[static_cast<std::size_t>(i + 1)] - support[0];
  const Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, 3, 3> gram = arms.transpose() * arms;
  const Eigen::Matrix<double, Eigen::Dynamic, 1, 0, 3, 1> half = gram.diagonal() / 2;
  const Eigen::Vector3d to_center = arms * gram.fullPivLu().solve(half);
  return {support[0] + to_center, to_center.squaredNorm()};
}

// The smallest ball that holds points[0, count) and has `support` on its surface. The recursion is at most
// four deep: a point outside is on the surface of the new ball.
Ball Enclose(Points points, std::size_t count, std::vector<Eigen::Vector3d>& support) {
  Ball ball = BallThrough(support);
  if (support.size() == 4) return ball;
  for (std::size_t i = 0; i < count; ++i) {
    if (ball.Holds(points[i])) continue;
    support.push_back(points[i]);
    ball = Enclose(points, i, support);
    support.pop_back();
  }
  return ball;
}

// Angles of the directions from the axis, as vectors across it: their length is the angle itself.
std::vector<Eigen::Vector3d> Unroll(const std::vector<Eigen::Vector3d>& units, const Eigen::Vector3d& axis) {
  const Eigen::Vector3d u = axis.unitOrthogonal(), v = axis.cross(u);
  std::vector<Eigen::Vector3d> angles;
  for (const Eigen::Vector3d& unit : units) {
    const Eigen::Vector3d arm = unit - axis;
    const double x = u.dot(arm), y = v.dot(arm);
    const double across = std::hypot(x, y);
    const double scale = across > 0 ? std::atan2(across, unit.dot(axis)) / across : 1;
    angles.emplace_back(x * scale, y * scale, 0);
  }
  return angles;
}

Eigen::Vector3d Turned(const Eigen::Vector3d& axis, const Eigen::Vector3d& angle) {
  const double size = angle.norm();
  if (!(size > 0)) return axis;
  const Eigen::Vector3d u = axis.unitOrthogonal(), v = axis.cross(u);
  const Eigen::Vector3d across = (angle.x() * u + angle.y() * v) / size;
  return (std::cos(size) * axis + std::sin(size) * across).normalized();
}

}  // namespace

Result<EnclosingBall> MinimumEnclosingBall(std::span<const Eigen::Vector3d> points) {
  if (points.empty()) return Fail(ErrorCode::kInvalidArgument, "no points, a ball needs at least 1");
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (!points[i].allFinite()) return Fail(ErrorCode::kInvalidArgument, "point {} is not finite", i);
  }
  std::vector<Eigen::Vector3d> local;
  for (const Eigen::Vector3d& p : points) local.push_back(p - points[0]);
  // In random order few points are outside the ball of those before them.
  std::shuffle(local.begin(), local.end(), std::mt19937_64(kShuffleSeed));
  std::vector<Eigen::Vector3d> support;
  const Ball ball = Enclose(local, local.size(), support);
  double squared = 0;
  for (const Eigen::Vector3d& p : local) squared = std::max(squared, (p - ball.center).squaredNorm());
  return EnclosingBall{points[0] + ball.center, std::sqrt(squared)};
}

Result<DirectionCone> MinimumCone(std::span<const Eigen::Vector3d> directions) {
  if (directions.empty()) return Fail(ErrorCode::kInvalidArgument, "no directions, a cone needs at least 1");
  std::vector<Eigen::Vector3d> units;
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (std::size_t i = 0; i < directions.size(); ++i) {
    const double length = directions[i].norm();
    if (!(length > 0) || !std::isfinite(length)) {
      return Fail(ErrorCode::kInvalidArgument, "direction {} is zero or not finite", i);
    }
    units.push_back(directions[i] / length);
    sum += units.back();
  }
  if (!(sum.norm() > 0)) {
    return Fail(ErrorCode::kDegenerate, "the {} directions point to all sides, they have no cone",
                directions.size());
  }
  DirectionCone cone{sum.normalized(), 0};
  // About the true axis lengths in the plane are angles from it, so there the smallest circle is the cone.
  for (int turn = 0; turn < kMaxTurns; ++turn) {
    const std::vector<Eigen::Vector3d> angles = Unroll(units, cone.axis);
    ASSIGN_OR_RETURN(const EnclosingBall circle, MinimumEnclosingBall(angles));
    cone.half_angle_rad = 0;
    for (const Eigen::Vector3d& angle : angles)
      cone.half_angle_rad = std::max(cone.half_angle_rad, angle.norm());
    if (!(circle.center.norm() > std::max(kSettled_rad, 1e-14 * circle.radius))) break;
    cone.axis = Turned(cone.axis, circle.center);
  }
  if (cone.half_angle_rad <= kWidestHalfAngle_rad) return cone;
  return Fail(ErrorCode::kDegenerate,
              "the {} directions need a cone with a half angle of {:.1f} degrees, at most 80 are allowed",
              directions.size(), cone.half_angle_rad * 180 / std::numbers::pi);
}

}  // namespace forgescan
