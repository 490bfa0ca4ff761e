#include "services/reconstruction/stereo_rig.h"

#include <Eigen/LU>
#include <cmath>
#include <opencv2/calib3d.hpp>
#include <opencv2/core/eigen.hpp>
#include <opencv2/imgproc.hpp>
#include <utility>

namespace forgescan {
namespace {

cv::Mat ToMat(const Eigen::Matrix3d& matrix) {
  cv::Mat result;
  cv::eigen2cv(matrix, result);
  return result;
}

cv::Mat_<cv::Vec2f> RectifyingMap(const CameraIntrinsics& camera, const cv::Mat& rotation,
                                  const cv::Mat& projection, cv::Size size) {
  cv::Mat map, unused;
  cv::initUndistortRectifyMap(ToMat(camera.camera_matrix), camera.distortion, rotation, projection, size,
                              CV_32FC2, map, unused);
  return map;
}

}  // namespace

Result<StereoRig> MakeStereoRig(const StereoCalibration& calibration, ImageSize image_size) {
  RETURN_IF_ERROR(Check(calibration));
  const auto& wanted = calibration.image_size;
  if (image_size.width_px <= 0 || image_size.height_px <= 0 ||
      (wanted && (wanted->width_px != image_size.width_px || wanted->height_px != image_size.height_px))) {
    return Fail(ErrorCode::kInvalidArgument, "the frames have {} x {} px, the calibration is for {} x {}",
                image_size.width_px, image_size.height_px, wanted ? wanted->width_px : 1,
                wanted ? wanted->height_px : 1);
  }
  const cv::Size size(image_size.width_px, image_size.height_px);
  cv::Mat translation, r1, r2, p1, p2, q;
  cv::eigen2cv(calibration.right_from_left.translation_mm, translation);
  cv::stereoRectify(ToMat(calibration.left.camera_matrix), calibration.left.distortion,
                    ToMat(calibration.right.camera_matrix), calibration.right.distortion, size,
                    ToMat(calibration.right_from_left.rotation), translation, r1, r2, p1, p2, q,
                    cv::CALIB_ZERO_DISPARITY);
  if (std::abs(p2.at<double>(1, 3)) > std::abs(p2.at<double>(0, 3))) {
    return Fail(ErrorCode::kInvalidArgument,
                "the cameras stand above each other; the baseline must run along image rows");
  }
  StereoRig rig;
  rig.left_map = RectifyingMap(calibration.left, r1, p1, size);
  rig.right_map = RectifyingMap(calibration.right, r2, p2, size);
  rig.focal_px = p1.at<double>(0, 0);
  rig.left_center_x_px = p1.at<double>(0, 2);
  rig.right_center_x_px = p2.at<double>(0, 2);
  rig.center_y_px = p1.at<double>(1, 2);
  rig.baseline_mm = -p2.at<double>(0, 3) / rig.focal_px;
  if (calibration.projector) {
    Eigen::Matrix3d rectified_from_left;
    cv::cv2eigen(r1, rectified_from_left);
    ProjectorCalibration projector = *calibration.projector;
    projector.projector_from_left.rotation =
        calibration.projector->projector_from_left.rotation * rectified_from_left.transpose();
    rig.projector.emplace(std::move(projector));
  }
  return rig;
}

}  // namespace forgescan
