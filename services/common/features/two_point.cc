#include "services/common/features/two_point.h"

#include <Eigen/Geometry>
#include <array>
#include <cmath>
#include <numbers>

namespace forgescan {
namespace {

constexpr double kHalfSectionMm = 2;
constexpr std::size_t kPatches = 90;  // around: 4 degrees each
constexpr std::size_t kLeastPoints = 3;

struct Unrolled {
  double along, radius;
  std::size_t patch;
};

Unrolled Unroll(const Eigen::Vector3d& p, const CylinderFit& cylinder, const Eigen::Vector3d& origin) {
  const Eigen::Vector3d u = cylinder.axis.unitOrthogonal(), v = cylinder.axis.cross(u);
  const Eigen::Vector3d arm = p - cylinder.axis_point;
  const double turn = std::atan2(v.dot(arm), u.dot(arm)) / (2 * std::numbers::pi) + 0.5;
  return {(p - origin).dot(cylinder.axis), std::hypot(u.dot(arm), v.dot(arm)),
          static_cast<std::size_t>(turn * kPatches) % kPatches};
}

struct Patch {
  std::vector<std::size_t> points;
  double sum = 0;

  double Radius() const { return sum / static_cast<double>(points.size()); }
};

double LargestOf(double count) { return std::sqrt(2 * std::log(std::max(1.0, count))); }

}  // namespace

TwoPointSizes MeasureTwoPoint(std::span<const Eigen::Vector3d> points, const CylinderFit& cylinder,
                              const Eigen::Vector3d& origin, std::span<const double> sections_mm) {
  TwoPointSizes result;
  for (const double section : sections_mm) {
    std::array<Patch, kPatches> patches;
    for (std::size_t i = 0; i < points.size(); ++i) {
      if (!(std::abs(cylinder.Residual(points[i])) <= cylinder.quality.limit_mm)) continue;
      const Unrolled at = Unroll(points[i], cylinder, origin);
      if (!(std::abs(at.along - section) <= kHalfSectionMm)) continue;
      patches[at.patch].points.push_back(i);
      patches[at.patch].sum += at.radius;
    }
    for (std::size_t i = 0; i < kPatches / 2; ++i) {
      const Patch &one = patches[i], &other = patches[i + kPatches / 2];
      if (std::min(one.points.size(), other.points.size()) < kLeastPoints) continue;
      result.sizes.push_back({one.Radius() + other.Radius(), section, one.points, other.points});
    }
  }
  const double directions = static_cast<double>(sections_mm.size()) * (kPatches / 2.0);
  if (directions > 0) result.seen_share = static_cast<double>(result.sizes.size()) / directions;
  return result;
}

Extreme ExpectedExtreme(const TwoPointSizes& found, double radius_mm, double patch_mm) {
  const double pitch_mm = 2 * std::numbers::pi * radius_mm / kPatches;
  const auto count = static_cast<double>(found.sizes.size());
  return {LargestOf(count), LargestOf(count * std::min(1.0, pitch_mm / patch_mm))};
}

double TwoPointNoise(std::span<const Eigen::Vector3d> points, const CylinderFit& cylinder,
                     std::span<const TwoPointSize> sizes) {
  double squares = 0, freedom = 0;
  for (const TwoPointSize& size : sizes) {
    for (const auto* patch : {&size.first, &size.second}) {
      const auto count = static_cast<double>(patch->size());
      double mean = 0;
      for (const std::size_t i : *patch) mean += cylinder.Residual(points[i]) / count;
      for (const std::size_t i : *patch) squares += std::pow(cylinder.Residual(points[i]) - mean, 2);
      freedom += count - 1;
    }
  }
  return squares / std::max(1.0, freedom);
}

WeighedPoints WeighTwoPoint(std::span<const Eigen::Vector3d> points, const CylinderFit& cylinder,
                            std::span<const TwoPointSize> sizes) {
  WeighedPoints result;
  result.points = points;
  result.weights.assign(points.size(), 0);
  for (const TwoPointSize& size : sizes) {
    for (const auto* patch : {&size.first, &size.second}) {
      const auto count = static_cast<double>(patch->size());
      for (const std::size_t i : *patch) {
        result.weights[i] += 1 / (count * static_cast<double>(sizes.size()));
      }
    }
  }
  const Eigen::Vector3d u = cylinder.axis.unitOrthogonal(), v = cylinder.axis.cross(u);
  for (const Eigen::Vector3d& p : points) {
    const Eigen::Vector3d arm = p - cylinder.axis_point;
    const Eigen::Vector3d radial = arm - arm.dot(cylinder.axis) * cylinder.axis;
    result.normals.push_back(radial.normalized());
    result.places.emplace_back(arm.dot(cylinder.axis),
                               std::atan2(v.dot(arm), u.dot(arm)) * cylinder.radius_mm);
  }
  return result;
}

}  // namespace forgescan
