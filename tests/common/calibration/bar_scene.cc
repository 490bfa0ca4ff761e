#include "tests/common/calibration/bar_scene.h"

#include <Eigen/Geometry>
#include <random>

#include "services/common/calibration/rig_geometry.h"

namespace forgescan {
namespace {

constexpr double kDistanceMm = 650;
constexpr double kTurnRad = 0.19;  // of each camera towards the middle

CameraIntrinsics Camera(double focal_px) {
  CameraIntrinsics camera;
  camera.camera_matrix << focal_px, 0, 1219, 0, focal_px, 1028, 0, 0, 1;
  camera.distortion = {-0.08, 0.09, 0.0002, -0.0001, 0};
  return camera;
}

// Of a device at x along the baseline that is turned by `turn` about y.
Eigen::Isometry3d DeviceFromMiddle(double x_mm, double turn_rad) {
  return Eigen::AngleAxisd(turn_rad, Eigen::Vector3d::UnitY()) * Eigen::Translation3d(-x_mm, 0, 0);
}

PoseFromLeft Pose(const Eigen::Isometry3d& target, const Eigen::Isometry3d& left) {
  const Eigen::Isometry3d pose = target * left.inverse();
  return {pose.linear(), pose.translation()};
}

std::string Numbers(const Eigen::Vector3d& p) {
  return fmt::format("[{:.6f}, {:.6f}, {:.6f}]", p.x(), p.y(), p.z());
}

}  // namespace

StereoCalibration TrueRig() {
  const Eigen::Isometry3d left = DeviceFromMiddle(-125, -kTurnRad), right = DeviceFromMiddle(125, kTurnRad);
  StereoCalibration rig{Camera(3003), Camera(2998), Pose(right, left), ImageSize{2448, 2048}, {}};
  rig.projector = {Camera(2350), Pose(DeviceFromMiddle(-25, 0), left)};
  return rig;
}

RigVector SomeError() {
  RigVector error;
  error << 0.25, -0.1, 0.2, -0.15, 0.0001, -0.1, 0.2, -0.25, 0.1, -0.0001, 0.00001, -0.00002, 0.00001, 0.008,
      -0.005, 0.006;
  return error;
}

std::vector<std::array<Eigen::Vector3d, 2>> BarPlaces(double distance_mm) {
  struct Place {
    Eigen::Vector3d middle, along;
  };
  const std::vector<Place> places = {
      {{-50, -100, 0}, {1, 0, 0}},    {{50, 100, 0}, {1, 0, 0}},     {{-50, 100, 0}, {1, 0, 0}},
      {{50, -100, 0}, {1, 0, 0}},     {{-100, -50, 0}, {0, 1, 0}},   {{100, 50, 0}, {0, 1, 0}},
      {{-100, 50, 0}, {0, 1, 0}},     {{100, -50, 0}, {0, 1, 0}},    {{0, 0, -70}, {1, 0, 0}},
      {{0, 0, -70}, {0, 1, 0}},       {{0, 0, 70}, {1, 0, 0}},       {{0, 0, 70}, {0, 1, 0}},
      {{-65, -60, 0}, {0.6, 0, 0.8}}, {{65, 60, 0}, {-0.6, 0, 0.8}}, {{0, -65, 0}, {0, 0.6, 0.8}},
      {{0, 65, 0}, {0, -0.6, 0.8}}};
  const Eigen::Vector3d middle_in_camera(125, 0, kDistanceMm);
  std::vector<std::array<Eigen::Vector3d, 2>> result;
  for (const Place& place : places) {
    const Eigen::Vector3d half = 0.5 * distance_mm * place.along.normalized();
    const Eigen::Vector3d middle = middle_in_camera + place.middle;
    result.push_back({middle - half, middle + half});
  }
  return result;
}

std::vector<BarPlacement> MeasuredBar(const StereoCalibration& calibration, double distance_mm,
                                      double noise_mm) {
  std::mt19937 random(7);
  std::normal_distribution<double> noise(0, noise_mm);
  const RigGeometry truth(TrueRig()), written(calibration);
  std::vector<BarPlacement> placements;
  for (const auto& place : BarPlaces(distance_mm)) {
    const std::vector<Eigen::Vector3d> seen = written.Triangulated(truth.Seen(place));
    BarPlacement placement{fmt::format("P{}", placements.size() + 1), {seen[0], seen[1]}, 0.003};
    for (Eigen::Vector3d& center : placement.center_in_camera) {
      for (double& coordinate : center) coordinate += noise_mm > 0 ? noise(random) : 0;
    }
    placements.push_back(placement);
  }
  return placements;
}

std::string PlacementsText(std::span<const BarPlacement> placements, double distance_mm) {
  std::string text = fmt::format(
      "distance_mm = {}\nexpanded_uncertainty_mm = 0.001\nball_radius_mm = 19.05\nvolume_mm = [240, 240, "
      "160]\n",
      distance_mm);
  for (const BarPlacement& placement : placements) {
    text += fmt::format("[[placement]]\nname = \"{}\"\ncenter_1_mm = {}\ncenter_2_mm = {}\n", placement.name,
                        Numbers(placement.center_in_camera[0]), Numbers(placement.center_in_camera[1]));
  }
  return text;
}

RefinementOptions BarOptions() {
  RefinementOptions options;
  options.placements.volume_mm = {240, 240, 160};
  return options;
}

}  // namespace forgescan
