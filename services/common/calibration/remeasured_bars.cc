#include "services/common/calibration/remeasured_bars.h"

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <array>
#include <cmath>
#include <numbers>

namespace forgescan {
namespace {

// Directions over the part of a ball that a camera on +z sees well: its disc is covered evenly.
std::vector<Eigen::Vector3d> CapDirections() {
  struct Ring {
    int count;
    double sine;  // of the angle to the view
  };
  constexpr std::array kRings = {Ring{1, 0.0}, Ring{6, 0.45}, Ring{12, 0.77}};
  std::vector<Eigen::Vector3d> directions;
  for (const Ring& ring : kRings) {
    for (int i = 0; i < ring.count; ++i) {
      const double around = 2 * std::numbers::pi * i / ring.count;
      directions.emplace_back(ring.sine * std::cos(around), ring.sine * std::sin(around),
                              std::sqrt(1 - ring.sine * ring.sine));
    }
  }
  return directions;
}

}  // namespace

RemeasuredBars::RemeasuredBars(const StereoCalibration& present, std::span<const BarPlacement> placements,
                               double ball_radius_mm) {
  const std::vector<Eigen::Vector3d> cap = CapDirections();
  for (const BarPlacement& placement : placements) {
    for (const Eigen::Vector3d& center : placement.center_in_camera) {
      centers_.push_back(center);
      const auto towards_camera = Eigen::Quaterniond::FromTwoVectors(Eigen::Vector3d::UnitZ(), -center);
      for (const Eigen::Vector3d& direction : cap) {
        outwards_.emplace_back(towards_camera * direction);
        points_.emplace_back(center + ball_radius_mm * outwards_.back());
      }
    }
  }
  pixels_ = RigGeometry(present).Seen(points_);
}

Eigen::VectorXd RemeasuredBars::DistancesBy(const StereoCalibration& calibration) const {
  const std::vector<Eigen::Vector3d> measured = RigGeometry(calibration).Triangulated(pixels_);
  std::vector<Eigen::Vector3d> centers;
  const std::size_t points_a_ball = points_.size() / centers_.size();
  for (std::size_t ball = 0; ball < centers_.size(); ++ball) {
    Eigen::Matrix3d matrix = Eigen::Matrix3d::Zero();
    Eigen::Vector3d right = Eigen::Vector3d::Zero();
    for (std::size_t i = ball * points_a_ball; i < (ball + 1) * points_a_ball; ++i) {
      matrix += outwards_[i] * outwards_[i].transpose();
      right += outwards_[i] * outwards_[i].dot(measured[i] - points_[i]);
    }
    centers.emplace_back(centers_[ball] + matrix.inverse() * right);
  }
  Eigen::VectorXd distances_mm(std::ssize(centers) / 2);
  for (Eigen::Index i = 0; i < distances_mm.size(); ++i) {
    const auto at = static_cast<std::size_t>(2 * i);
    distances_mm(i) = (centers[at + 1] - centers[at]).norm();
  }
  return distances_mm;
}

}  // namespace forgescan
