#include "tests/bench/stereo_scene.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

namespace forgescan::bench {
namespace {

constexpr double kDistanceMm = 520;

CameraIntrinsics Lens(double focal_px, Eigen::Vector2d center_px, std::vector<double> distortion) {
  CameraIntrinsics lens;
  lens.camera_matrix << focal_px, 0, center_px.x(), 0, focal_px, center_px.y(), 0, 0, 1;
  lens.distortion = std::move(distortion);
  return lens;
}

// At center_x_mm beside the left camera, its axis meeting the left one's.
PoseFromLeft Aimed(double center_x_mm) {
  PoseFromLeft pose;
  pose.rotation =
      Eigen::AngleAxisd(std::atan2(center_x_mm, kDistanceMm), Eigen::Vector3d::UnitY()).toRotationMatrix();
  pose.translation_mm = -pose.rotation * Eigen::Vector3d(center_x_mm, 0, 0);
  return pose;
}

using Ray = Eigen::ParametrizedLine<double, 3>;

double HitPlate(const Ray& ray) {
  const Eigen::Vector3d normal = Eigen::Vector3d(0.12, -0.08, -1).normalized();
  return (normal.dot(Eigen::Vector3d(0, 0, 560)) - normal.dot(ray.origin())) / normal.dot(ray.direction());
}

double HitCylinder(const Ray& ray) {
  const Eigen::Vector3d axis = Eigen::Vector3d(1, 0.25, 0.05).normalized(), on_axis(0, 40, 535);
  const Eigen::Vector3d from = (ray.origin() - on_axis) - axis * axis.dot(ray.origin() - on_axis);
  const Eigen::Vector3d along = ray.direction() - axis * axis.dot(ray.direction());
  const double a = along.squaredNorm(), b = along.dot(from), c = from.squaredNorm() - 45.0 * 45.0;
  return b * b - a * c > 0 ? (-b - std::sqrt(b * b - a * c)) / a : -1;
}

double HitBlock(const Ray& ray) {
  const Eigen::Vector3d low(-110, -95, 515), high(40, -30, 600);
  double enter = 0, leave = 1e9;
  for (Eigen::Index i = 0; i < 3; ++i) {
    const double a = (low(i) - ray.origin()(i)) / ray.direction()(i);
    const double b = (high(i) - ray.origin()(i)) / ray.direction()(i);
    enter = std::max(enter, std::min(a, b));
    leave = std::min(leave, std::max(a, b));
  }
  return enter < leave ? enter : -1;
}

// Holes of the picture: places that show no fringes.
bool IsHole(const Eigen::Vector3d& p) {
  const Eigen::Vector2d cell(std::remainder(p.x(), 60.0), std::remainder(p.y() - 10, 75.0));
  return cell.norm() < 4;
}

double HitAll(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction) {
  const Ray ray(origin, direction);
  double nearest = -1;
  for (const double at : {HitPlate(ray), HitCylinder(ray), HitBlock(ray)}) {
    nearest = at > 0 && (nearest < 0 || at < nearest) ? at : nearest;
  }
  return nearest;
}

}  // namespace

StereoCalibration BenchRig() {
  StereoCalibration rig;
  rig.left = Lens(3480, {1231.4, 1018.7}, {-0.08, 0.09, 0.0003, -0.0002, 0});
  rig.right = Lens(3487, {1218.9, 1030.2}, {-0.075, 0.08, -0.0002, 0.0003, 0});
  rig.right_from_left = Aimed(150);
  rig.image_size = ImageSize{2448, 2048};
  rig.projector = ProjectorCalibration{.intrinsics = Lens(2700, {959.5, 600}, {0, 0, 0, 0, 0}),
                                       .projector_from_left = Aimed(75)};
  return rig;
}

DecodedScene BenchScene() {
  return {.hit = HitAll, .is_hole = IsHole, .projector_width_px = 1920, .noise_px = 0.02};
}

}  // namespace forgescan::bench
