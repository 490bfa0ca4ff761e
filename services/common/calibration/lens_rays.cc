#include "services/common/calibration/lens_rays.h"

#include <opencv2/calib3d.hpp>
#include <opencv2/core/eigen.hpp>

namespace forgescan {
namespace {

cv::Mat CameraMatrix(const CameraIntrinsics& camera) {
  cv::Mat matrix;
  cv::eigen2cv(camera.camera_matrix, matrix);
  return matrix;
}

}  // namespace

std::vector<Eigen::Vector2d> ProjectPoints(const CameraIntrinsics& camera,
                                           std::span<const Eigen::Vector3d> p_in_camera) {
  std::vector<cv::Point3d> points;
  for (const Eigen::Vector3d& p : p_in_camera) points.emplace_back(p.x(), p.y(), p.z());
  std::vector<cv::Point2d> pixels;
  const cv::Vec3d none(0, 0, 0);
  if (!points.empty()) {
    cv::projectPoints(points, none, none, CameraMatrix(camera), camera.distortion, pixels);
  }
  std::vector<Eigen::Vector2d> result;
  for (const cv::Point2d& pixel : pixels) result.emplace_back(pixel.x, pixel.y);
  return result;
}

std::vector<Eigen::Vector3d> PixelRays(const CameraIntrinsics& camera,
                                       std::span<const Eigen::Vector2d> pixels) {
  std::vector<cv::Point2d> raw, rays;
  for (const Eigen::Vector2d& pixel : pixels) raw.emplace_back(pixel.x(), pixel.y());
  if (!raw.empty()) {
    cv::undistortPoints(raw, rays, CameraMatrix(camera), camera.distortion, cv::noArray(), cv::noArray(),
                        cv::TermCriteria(cv::TermCriteria::COUNT | cv::TermCriteria::EPS, 40, 1e-10));
  }
  std::vector<Eigen::Vector3d> result;
  for (const cv::Point2d& ray : rays) result.emplace_back(ray.x, ray.y, 1);
  return result;
}

}  // namespace forgescan
