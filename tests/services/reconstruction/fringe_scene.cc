#include "tests/services/reconstruction/fringe_scene.h"

#include <Eigen/Geometry>
#include <cmath>
#include <numbers>
#include <opencv2/calib3d.hpp>
#include <opencv2/core/eigen.hpp>
#include <random>

namespace forgescan {
namespace {

constexpr int kWidthPx = 320;
constexpr int kHeightPx = 240;

CameraIntrinsics Lens(double focal_px, double center_x_px, double center_y_px,
                      std::vector<double> distortion) {
  CameraIntrinsics lens;
  lens.camera_matrix << focal_px, 0, center_x_px, 0, focal_px, center_y_px, 0, 0, 1;
  lens.distortion = std::move(distortion);
  return lens;
}

// Looks from center_mm so that its axis meets the left camera's axis at 400 mm.
PoseFromLeft Aimed(double center_x_mm) {
  PoseFromLeft pose;
  const double angle = std::atan2(center_x_mm, 400);
  pose.rotation = Eigen::AngleAxisd(angle, Eigen::Vector3d::UnitY()).toRotationMatrix();
  pose.translation_mm = -pose.rotation * Eigen::Vector3d(center_x_mm, 0, 0);
  return pose;
}

// Projector column that lights each pixel; NaN where nothing is hit.
cv::Mat_<double> Columns(const CameraIntrinsics& lens, const PoseFromLeft& pose, const Surface& surface,
                         const ProjectorCalibration& projector) {
  std::vector<cv::Point2d> pixels, rays;
  for (int y = 0; y < kHeightPx; ++y) {
    for (int x = 0; x < kWidthPx; ++x) {
      pixels.emplace_back(x, y);
    }
  }
  cv::Mat camera_matrix;
  cv::eigen2cv(lens.camera_matrix, camera_matrix);
  cv::undistortPoints(pixels, rays, camera_matrix, lens.distortion, cv::noArray(), cv::noArray(),
                      cv::TermCriteria(cv::TermCriteria::COUNT | cv::TermCriteria::EPS, 50, 1e-12));
  cv::Mat_<double> columns(kHeightPx, kWidthPx);
  for (int i = 0; i < kHeightPx * kWidthPx; ++i) {
    const cv::Point2d& ray = rays[static_cast<std::size_t>(i)];
    const auto hit =
        surface({.origin_in_left = -pose.rotation.transpose() * pose.translation_mm,
                 .direction_in_left = pose.rotation.transpose() * Eigen::Vector3d(ray.x, ray.y, 1)});
    columns(i / kWidthPx, i % kWidthPx) = std::numeric_limits<double>::quiet_NaN();
    if (hit) {
      const auto& from_left = projector.projector_from_left;
      const Eigen::Vector3d p =
          projector.intrinsics.camera_matrix * (from_left.rotation * *hit + from_left.translation_mm);
      columns(i / kWidthPx, i % kWidthPx) = p.x() / p.z();
    }
  }
  return columns;
}

cv::Mat RenderFrame(const cv::Mat_<double>& columns, const FringeFrequency& frequency, std::size_t index,
                    const Lighting& lighting, std::mt19937& random) {
  std::normal_distribution<double> noise(0, 1);
  cv::Mat frame(columns.size(), CV_8UC1);
  for (int y = 0; y < columns.rows; ++y) {
    for (int x = 0; x < columns.cols; ++x) {
      const double angle =
          2 * std::numbers::pi * columns(y, x) / frequency.period_px + frequency.shift_rad[index];
      const double fringe = std::cos(angle) + lighting.second_harmonic * std::cos(2 * angle);
      double grey = std::isnan(angle) ? 10 : lighting.background_dn + lighting.modulation_dn * fringe;
      grey += lighting.noise_dn * noise(random);
      frame.at<std::uint8_t>(y, x) = cv::saturate_cast<std::uint8_t>(grey);
    }
  }
  return frame;
}

std::vector<cv::Mat> RenderCamera(const cv::Mat_<double>& columns, const PatternSet& pattern,
                                  const Lighting& lighting, unsigned seed) {
  std::mt19937 random(seed);
  std::vector<cv::Mat> frames(static_cast<std::size_t>(pattern.frame_count()));
  for (const FringeFrequency& frequency : pattern.frequencies) {
    for (std::size_t i = 0; i < frequency.frame_index.size(); ++i) {
      frames[static_cast<std::size_t>(frequency.frame_index[i])] =
          RenderFrame(columns, frequency, i, lighting, random);
    }
  }
  return frames;
}

}  // namespace

Surface Plane(const Eigen::Vector3d& normal, double offset_mm) {
  return [normal, offset_mm](const Ray& ray) -> std::optional<Eigen::Vector3d> {
    const double along = (offset_mm - normal.dot(ray.origin_in_left)) / normal.dot(ray.direction_in_left);
    return ray.origin_in_left + along * ray.direction_in_left;
  };
}

Surface Sphere(const Eigen::Vector3d& center_mm, double radius_mm) {
  return [center_mm, radius_mm](const Ray& ray) -> std::optional<Eigen::Vector3d> {
    const Eigen::Vector3d direction = ray.direction_in_left.normalized();
    const Eigen::Vector3d to_center = center_mm - ray.origin_in_left;
    const double along = to_center.dot(direction);
    const double half_chord = radius_mm * radius_mm - (to_center.squaredNorm() - along * along);
    if (half_chord <= 0) {
      return std::nullopt;
    }
    return ray.origin_in_left + (along - std::sqrt(half_chord)) * direction;
  };
}

StereoCalibration SmallRig() {
  StereoCalibration rig;
  rig.left = Lens(600, 161.3, 118.9, {-0.08, 0.05, 0.0004, -0.0003, 0});
  rig.right = Lens(602, 158.2, 121.4, {-0.06, 0.02, -0.0002, 0.0005, 0});
  rig.right_from_left = Aimed(120);
  rig.image_size = ImageSize{kWidthPx, kHeightPx};
  rig.projector = ProjectorCalibration{.intrinsics = Lens(800, 255.5, 200, {0, 0, 0, 0, 0}),
                                       .projector_from_left = Aimed(60)};
  return rig;
}

PatternSet SmallPattern(Background background) {
  PatternSet pattern;
  pattern.projector_width_px = 512;
  pattern.background = background;
  for (const double fringes : {20.0, 19.0, 16.0}) {
    FringeFrequency frequency;
    frequency.period_px = 520 / fringes;  // not a divisor of the width on purpose
    const int frames = background == Background::kOwn ? 4 : (fringes == 20.0 ? 3 : 2);
    for (int i = 0; i < frames; ++i) {
      frequency.frame_index.push_back(pattern.frame_count());
      frequency.shift_rad.push_back(i * std::numbers::pi / 2);
      pattern.frame_names.push_back(fmt::format("{}", pattern.frame_count()));
    }
    pattern.frequencies.push_back(frequency);
  }
  return pattern;
}

StereoFrames Render(const Surface& surface, const StereoCalibration& rig, const PatternSet& pattern,
                    const Lighting& lighting) {
  const auto left = Columns(rig.left, PoseFromLeft{}, surface, *rig.projector);
  const auto right = Columns(rig.right, rig.right_from_left, surface, *rig.projector);
  return {.left = RenderCamera(left, pattern, lighting, lighting.seed),
          .right = RenderCamera(right, pattern, lighting, lighting.seed + 1000)};
}

}  // namespace forgescan
