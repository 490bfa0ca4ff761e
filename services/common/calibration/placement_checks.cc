#include "services/common/calibration/placement_checks.h"

#include <algorithm>
#include <cmath>
#include <set>

#include "services/common/calibration/rig_geometry.h"

namespace forgescan {
namespace {

constexpr std::array kAxes = {"x (along the rows)", "y (across the rows)", "z (depth)"};
constexpr double kMaxLengthMm = 10'000;
constexpr double kMaxDistanceError =
    0.02;  // share of the distance: beyond, it is another bar or another unit

Status CheckRange(const char* what, double value, double low, double high) {
  if (value >= low && value <= high) return {};
  return Fail(ErrorCode::kInvalidArgument, "{} is {} mm, allowed {} to {}", what, value, low, high);
}

Status CheckBar(const BallBar& bar) {
  RETURN_IF_ERROR(CheckRange("the certified distance", bar.distance_mm, 1, kMaxLengthMm));
  RETURN_IF_ERROR(
      CheckRange("its standard uncertainty", bar.distance_sigma_mm, 0, bar.distance_mm * kMaxDistanceError));
  return CheckRange("the radius of the balls", bar.ball_radius_mm, 0, bar.distance_mm / 2);
}

Status CheckVolume(const Eigen::Vector3d& volume_mm) {
  for (int axis = 0; axis < 3; ++axis) {
    RETURN_IF_ERROR(CheckRange("a side of the measuring volume", volume_mm(axis), 1, kMaxLengthMm));
  }
  return {};
}

bool IsInside(const Eigen::Vector2d& pixel, const std::optional<ImageSize>& size) {
  if (!size) return pixel.allFinite();
  return pixel.x() >= 0 && pixel.y() >= 0 && pixel.x() <= size->width_px - 1 &&
         pixel.y() <= size->height_px - 1;
}

Status CheckPlacement(const BarPlacement& placement, const BallBar& bar, const RigGeometry& rig,
                      const std::optional<ImageSize>& size) {
  if (!(placement.center_sigma_mm > 0 && placement.center_sigma_mm <= 1)) {
    return Fail(ErrorCode::kInvalidArgument,
                "placement {}: the standard deviation of a centre is {} mm, allowed above 0 to 1",
                placement.name, placement.center_sigma_mm);
  }
  const auto& centers = placement.center_in_camera;
  const PixelPairs pixels = rig.Seen(centers);
  for (std::size_t i = 0; i < 2; ++i) {
    const bool is_seen = centers[i].allFinite() && centers[i].z() > 0 && IsInside(pixels.left[i], size) &&
                         IsInside(pixels.right[i], size);
    if (!is_seen) {
      return Fail(ErrorCode::kInvalidArgument,
                  "placement {}: ball {} at {:.1f}, {:.1f}, {:.1f} mm is outside of what both cameras see; "
                  "centres are wanted in the frame of the rectified left camera",
                  placement.name, i + 1, centers[i].x(), centers[i].y(), centers[i].z());
    }
  }
  if (std::abs(placement.DistanceMm() - bar.distance_mm) > kMaxDistanceError * bar.distance_mm) {
    return Fail(
        ErrorCode::kInvalidArgument,
        "placement {}: the centres are {:.3f} mm apart, the certified distance is {:.3f} mm, more than "
        "{:.0f} % off: another bar, or another unit",
        placement.name, placement.DistanceMm(), bar.distance_mm, 100 * kMaxDistanceError);
  }
  return {};
}

// How far the ball that moved more moved, whichever ball is called the first.
double MoveMm(const BarPlacement& from, const BarPlacement& to) {
  const auto& [a, b] = from.center_in_camera;
  const auto& [c, d] = to.center_in_camera;
  return std::min(std::max((c - a).norm(), (d - b).norm()), std::max((d - a).norm(), (c - b).norm()));
}

// A place measured twice would vouch for itself when it is left out.
Status CheckPlaces(std::span<const BarPlacement> placements, double min_move_mm) {
  for (std::size_t i = 0; i < placements.size(); ++i) {
    for (std::size_t j = i + 1; j < placements.size(); ++j) {
      const double move_mm = MoveMm(placements[i], placements[j]);
      if (move_mm >= min_move_mm) continue;
      return Fail(ErrorCode::kDegenerate,
                  "placements {} and {} are one place: no ball moved by more than {:.1f} mm, at least {:.1f} mm "
                  "are needed",
                  placements[i].name, placements[j].name, move_mm, min_move_mm);
    }
  }
  return {};
}

Status CheckAxis(std::span<const BarPlacement> placements, const PlacementRules& rules, int axis) {
  const char* name = kAxes.at(static_cast<std::size_t>(axis));
  double low = placements.front().center_in_camera[0](axis), high = low;
  std::size_t along = 0;
  for (const BarPlacement& placement : placements) {
    const auto& [a, b] = placement.center_in_camera;
    low = std::min({low, a(axis), b(axis)});
    high = std::max({high, a(axis), b(axis)});
    along += std::abs((b - a).normalized()(axis)) >= rules.min_cosine ? 1 : 0;
  }
  if (high - low < rules.min_extent * rules.volume_mm(axis)) {
    return Fail(
        ErrorCode::kDegenerate,
        "the placements do not span the volume along {}: {:.0f} mm of {:.0f} mm, at least {:.0f} % are "
        "needed",
        name, high - low, rules.volume_mm(axis), 100 * rules.min_extent);
  }
  if (along < rules.min_along) {
    return Fail(ErrorCode::kDegenerate,
                "{} of the placements run along {} (within {:.0f} degrees), at least {} are needed", along,
                name, std::acos(rules.min_cosine) * 180 / std::numbers::pi, rules.min_along);
  }
  return {};
}

}  // namespace

Status CheckPlacements(const BallBar& bar, std::span<const BarPlacement> placements,
                       const StereoCalibration& calibration, const PlacementRules& rules) {
  RETURN_IF_ERROR(Check(calibration));
  RETURN_IF_ERROR(CheckBar(bar));
  RETURN_IF_ERROR(CheckVolume(rules.volume_mm));
  const RigGeometry rig(calibration);
  std::set<std::string> names;
  for (const BarPlacement& placement : placements) {
    if (!names.insert(placement.name).second) {
      return Fail(ErrorCode::kInvalidArgument, "two placements are called {}", placement.name);
    }
    RETURN_IF_ERROR(CheckPlacement(placement, bar, rig, calibration.image_size));
  }
  if (placements.size() < std::max<std::size_t>(1, rules.min_placements)) {
    return Fail(ErrorCode::kDegenerate, "{} placements, at least {} are needed", placements.size(),
                rules.min_placements);
  }
  RETURN_IF_ERROR(CheckPlaces(placements, rules.min_move * bar.distance_mm));
  for (int axis = 0; axis < 3; ++axis) {
    RETURN_IF_ERROR(CheckAxis(placements, rules, axis));
  }
  return {};
}

}  // namespace forgescan
