#include "tests/services/reconstruction/decoded_scene.h"

#include <limits>
#include <opencv2/calib3d.hpp>
#include <opencv2/core/eigen.hpp>
#include <opencv2/imgproc.hpp>
#include <random>
#include <vector>

#include "services/reconstruction/view_pool.h"

namespace forgescan {
namespace {

struct Seen {
  MaskCause cause = MaskCause::kLowModulation;
  double column_px = 0;
};

Seen Look(const DecodedScene& scene, const Eigen::Vector3d& origin, const Eigen::Vector3d& direction,
          const ProjectorCalibration& projector) {
  const double at = scene.hit(origin, direction);
  const Eigen::Vector3d p = origin + at * direction;
  if (at <= 0 || scene.is_hole(p)) {
    return {};
  }
  const auto& pose = projector.projector_from_left;
  const Eigen::Vector3d light = -pose.rotation.transpose() * pose.translation_mm;
  if (scene.hit(light, p - light) < 1 - 1e-6) {
    return {};
  }
  const Eigen::Vector3d image =
      projector.intrinsics.camera_matrix * (pose.rotation * p + pose.translation_mm);
  const double column_px = image.x() / image.z();
  const bool inside = column_px > 0 && column_px < scene.projector_width_px - 1;
  return {inside ? MaskCause::kValid : MaskCause::kOutOfRange, column_px};
}

// Directions of a row of raw pixels, z = 1.
std::vector<cv::Point2d> RowRays(const CameraIntrinsics& lens, int row, int width) {
  std::vector<cv::Point2d> pixels, rays;
  for (int x = 0; x < width; ++x) {
    pixels.emplace_back(x, row);
  }
  cv::Mat camera_matrix;
  cv::eigen2cv(lens.camera_matrix, camera_matrix);
  cv::undistortPoints(pixels, rays, camera_matrix, lens.distortion, cv::noArray(), cv::noArray(),
                      cv::TermCriteria(cv::TermCriteria::COUNT | cv::TermCriteria::EPS, 30, 1e-10));
  return rays;
}

void MaskBorder(DecodedView& view) {
  cv::Mat grown;
  cv::dilate(view.cause != 0, grown, cv::getStructuringElement(cv::MORPH_RECT, {5, 5}));
  view.cause.setTo(static_cast<std::uint8_t>(MaskCause::kBorder), grown & (view.cause == 0));
  view.coordinate_px.setTo(std::numeric_limits<float>::quiet_NaN(), view.cause != 0);
}

}  // namespace

DecodedView SeeDecoded(const DecodedScene& scene, const CameraIntrinsics& lens, const PoseFromLeft& pose,
                       const StereoCalibration& rig, unsigned seed) {
  const ImageSize size = *rig.image_size;
  DecodedView view;
  CreateMaps({size.width_px, size.height_px}, view);
  view.variance_px2 = UpperOfFloat(static_cast<float>(scene.noise_px * scene.noise_px));
  std::mt19937 random(seed);
  std::normal_distribution<double> noise(0, 1);
  const Eigen::Vector3d origin = -pose.rotation.transpose() * pose.translation_mm;
  for (int y = 0; y < size.height_px; ++y) {
    const auto rays = RowRays(lens, y, size.width_px);
    for (int x = 0; x < size.width_px; ++x) {
      const cv::Point2d& ray = rays[static_cast<std::size_t>(x)];
      const Eigen::Vector3d direction = pose.rotation.transpose() * Eigen::Vector3d(ray.x, ray.y, 1);
      const Seen seen = Look(scene, origin, direction, *rig.projector);
      view.cause(y, x) = static_cast<std::uint8_t>(seen.cause);
      view.coordinate_px(y, x) = static_cast<float>(seen.column_px + scene.noise_px * noise(random));
    }
  }
  if (!scene.keeps_masked) {
    MaskBorder(view);
  }
  return view;
}

Eigen::Matrix3d RectifiedFromLeft(const StereoCalibration& rig) {
  cv::Mat kl, kr, r, t, r1, r2, p1, p2, q;
  cv::eigen2cv(rig.left.camera_matrix, kl);
  cv::eigen2cv(rig.right.camera_matrix, kr);
  cv::eigen2cv(rig.right_from_left.rotation, r);
  cv::eigen2cv(rig.right_from_left.translation_mm, t);
  cv::stereoRectify(kl, rig.left.distortion, kr, rig.right.distortion,
                    {rig.image_size->width_px, rig.image_size->height_px}, r, t, r1, r2, p1, p2, q);
  Eigen::Matrix3d rotation;
  cv::cv2eigen(r1, rotation);
  return rotation;
}

}  // namespace forgescan
