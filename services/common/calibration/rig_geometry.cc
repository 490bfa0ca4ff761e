#include "services/common/calibration/rig_geometry.h"

#include <opencv2/calib3d.hpp>
#include <opencv2/core/eigen.hpp>

#include "services/common/calibration/lens_rays.h"

namespace forgescan {
namespace {

struct Rectifications {
  Eigen::Matrix3d left, right;
};

// They depend on the pose alone; lenses and image size only scale the rectified images.
Rectifications Rectify(const PoseFromLeft& right_from_left) {
  cv::Mat rotation, translation, r1, r2, p1, p2, q;
  cv::eigen2cv(right_from_left.rotation, rotation);
  cv::eigen2cv(right_from_left.translation_mm, translation);
  const cv::Mat any = cv::Mat::eye(3, 3, CV_64F);
  cv::stereoRectify(any, cv::noArray(), any, cv::noArray(), cv::Size(1, 1), rotation, translation, r1, r2, p1,
                    p2, q, cv::CALIB_ZERO_DISPARITY);
  Rectifications result;
  cv::cv2eigen(r1, result.left);
  cv::cv2eigen(r2, result.right);
  return result;
}

}  // namespace

RigGeometry::RigGeometry(const StereoCalibration& calibration) : calibration_(calibration) {
  const PoseFromLeft& pose = calibration.right_from_left;
  const Rectifications rectifications = Rectify(pose);
  rectified_from_left_ = rectifications.left;
  rectified_from_right_ = rectifications.right;
  baseline_mm_ = (rectified_from_left_ * -(pose.rotation.transpose() * pose.translation_mm)).x();
  if (calibration.projector) {
    const PoseFromLeft& projector = calibration.projector->projector_from_left;
    left_share_ = (rectified_from_left_ * -(projector.rotation.transpose() * projector.translation_mm)).x() /
                  baseline_mm_;
  }
}

std::vector<Eigen::Vector3d> RigGeometry::LeftFromCamera(std::span<const Eigen::Vector3d> p_in_camera) const {
  std::vector<Eigen::Vector3d> p_in_left;
  for (const Eigen::Vector3d& p : p_in_camera) p_in_left.emplace_back(rectified_from_left_.transpose() * p);
  return p_in_left;
}

PixelPairs RigGeometry::Seen(std::span<const Eigen::Vector3d> p_in_camera) const {
  const std::vector<Eigen::Vector3d> p_in_left = LeftFromCamera(p_in_camera);
  std::vector<Eigen::Vector3d> p_in_right;
  const PoseFromLeft& pose = calibration_.right_from_left;
  for (const Eigen::Vector3d& p : p_in_left) p_in_right.emplace_back(pose.rotation * p + pose.translation_mm);
  return {ProjectPoints(calibration_.left, p_in_left), ProjectPoints(calibration_.right, p_in_right)};
}

std::vector<Eigen::Vector3d> RigGeometry::Triangulated(const PixelPairs& pixels) const {
  const std::vector<Eigen::Vector3d> left = PixelRays(calibration_.left, pixels.left);
  const std::vector<Eigen::Vector3d> right = PixelRays(calibration_.right, pixels.right);
  std::vector<Eigen::Vector3d> points;
  for (std::size_t i = 0; i < left.size(); ++i) {
    Eigen::Vector3d l = rectified_from_left_ * left[i], r = rectified_from_right_ * right[i];
    l /= l.z();
    r /= r.z();
    const double z_mm = baseline_mm_ / (l.x() - r.x());
    points.emplace_back(l.x() * z_mm, (left_share_ * l.y() + (1 - left_share_) * r.y()) * z_mm, z_mm);
  }
  return points;
}

}  // namespace forgescan
