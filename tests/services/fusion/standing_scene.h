// What a camera sees of a cell without a part: squares that fix all six motions, or only some.
#pragma once

#include <Eigen/Geometry>
#include <random>

#include "services/common/geometry/point_cloud.h"
#include "services/fusion/visit_error.h"

namespace forgescan::testing {

inline constexpr double kNoiseMm = 0.02;

inline VisitErrorOptions Robot() {
  VisitErrorOptions options;
  options.robot_shift_mm = 0.005;
  options.robot_turn_rad = 0.000024;
  return options;
}

inline VisitErrorOptions AtLeast(std::size_t cells) {
  VisitErrorOptions options = Robot();
  options.min_cells = cells;
  return options;
}

inline const Eigen::Vector3d kMiddle(0, 0, 650);  // of what the camera sees

// A square of 100 mm through `center`, a point every 0.6 mm.
inline void AddSquare(const Eigen::Vector3d& center, const Eigen::Vector3d& normal, std::mt19937& random,
                      PointCloud& cloud) {
  std::normal_distribution<double> noise(0, kNoiseMm);
  const Eigen::Vector3d u = normal.unitOrthogonal(), v = normal.cross(u);
  for (int i = -83; i <= 83; ++i) {
    for (int j = -83; j <= 83; ++j) {
      const Eigen::Vector3d p = center + 0.6 * (i * u + j * v) + noise(random) * normal;
      cloud.points.push_back(p.cast<float>());
      cloud.normals.push_back(normal.cast<float>());
      cloud.sigma_mm.push_back(static_cast<float>(kNoiseMm));
    }
  }
}

inline PointCloud Plane(unsigned seed) {
  std::mt19937 random(seed);
  PointCloud cloud;
  AddSquare(kMiddle, -Eigen::Vector3d::UnitZ(), random, cloud);
  return cloud;
}

// Three squares that fix all six motions.
inline PointCloud Corner(unsigned seed) {
  std::mt19937 random(seed);
  PointCloud cloud;
  AddSquare(kMiddle + Eigen::Vector3d(0, 80, 0), Eigen::Vector3d(0, 0, -1), random, cloud);
  AddSquare(kMiddle + Eigen::Vector3d(90, 0, 0), Eigen::Vector3d(-0.8, 0, -0.6), random, cloud);
  AddSquare(kMiddle + Eigen::Vector3d(-90, -60, 0), Eigen::Vector3d(0, 0.8, -0.6), random, cloud);
  return cloud;
}

inline PointCloud Moved(PointCloud cloud, const Eigen::Isometry3d& motion) {
  for (Eigen::Vector3f& p : cloud.points) p = (motion * p.cast<double>()).cast<float>();
  for (Eigen::Vector3f& n : cloud.normals) n = (motion.linear() * n.cast<double>()).cast<float>();
  return cloud;
}

inline Eigen::Isometry3d Motion(const Eigen::Vector3d& shift_mm, const Eigen::Vector3d& turn_rad) {
  return Eigen::Translation3d(kMiddle + shift_mm) *
         Eigen::AngleAxisd(turn_rad.norm(), (turn_rad + Eigen::Vector3d(1e-30, 0, 0)).normalized()) *
         Eigen::Translation3d(-kMiddle);
}

}  // namespace forgescan::testing
