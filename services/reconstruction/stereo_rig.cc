#include "services/reconstruction/stereo_rig.h"

#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <opencv2/calib3d.hpp>
#include <opencv2/core/eigen.hpp>
#include <utility>
#include <vector>

namespace forgescan {
namespace {

cv::Mat ToMat(const Eigen::Matrix3d& matrix) {
  cv::Mat result;
  cv::eigen2cv(matrix, result);
  return result;
}

// Where a ray at the tangent `radius` from the axis ends up, by the radial terms of OpenCV's model.
double DistortedRadius(const std::vector<double>& distortion, double radius) {
  const auto k = [&](std::size_t at) { return at < distortion.size() ? distortion[at] : 0.0; };
  const double s = radius * radius;
  return radius * (1 + s * (k(0) + s * (k(1) + s * k(4)))) / (1 + s * (k(5) + s * (k(6) + s * k(7))));
}

// The lens must map every ray of the frame to a pixel of its own, and not far from where a pinhole would.
Status CheckDistortion(const CameraIntrinsics& camera, ImageSize size, const char* which) {
  constexpr double kMaxShift = 0.3;  // of the corner's radius; lenses that measure shift it by 0.1 at most
  constexpr int kSteps = 1000;
  const Eigen::Matrix3d& k = camera.camera_matrix;
  const double corner = std::hypot(std::max(k(0, 2), size.width_px - k(0, 2)) / k(0, 0),
                                   std::max(k(1, 2), size.height_px - k(1, 2)) / k(1, 1));
  double reached = 0;
  double radius = 0;
  for (int step = 1; reached < corner && radius < corner / (1 - kMaxShift); ++step) {
    radius = corner * step / kSteps;
    const double next = DistortedRadius(camera.distortion, radius);
    if (!(next > reached)) {
      return Fail(ErrorCode::kInvalidArgument,
                  "the distortion of the {} folds the image over at {:.2f} of the corner's radius", which,
                  radius / corner);
    }
    reached = next;
  }
  if (!(reached >= corner) || radius < corner * (1 - kMaxShift)) {
    return Fail(ErrorCode::kInvalidArgument,
                "the distortion of the {} shifts a corner of the frame by more than {:.0f} % of its radius",
                which, 100 * kMaxShift);
  }
  return {};
}

// A calibration made for another image size or another lens mostly shows here. which: for the sentence.
Status CheckFitsFrame(const CameraIntrinsics& camera, ImageSize size, const char* which) {
  const std::array lengths_px = {size.width_px, size.height_px};
  for (Eigen::Index axis = 0; axis < 2; ++axis) {
    const int length_px = lengths_px[static_cast<std::size_t>(axis)];
    const double center_px = camera.camera_matrix(axis, 2);
    if (!(center_px >= 0.25 * length_px && center_px <= 0.75 * length_px)) {
      return Fail(ErrorCode::kInvalidArgument,
                  "the principal point of the {} is at {} = {:.1f} px, outside the middle half of the {} px "
                  "of the frames: the calibration is for another image size",
                  which, axis == 0 ? 'x' : 'y', center_px, length_px);
    }
    constexpr double kMinFieldDeg = 2, kMaxFieldDeg = 120;
    const double field_deg =
        2 * std::atan(length_px / (2 * camera.camera_matrix(axis, axis))) * 180 / std::numbers::pi;
    if (!(field_deg >= kMinFieldDeg && field_deg <= kMaxFieldDeg)) {
      return Fail(ErrorCode::kInvalidArgument,
                  "the {} would see {:.1f} degrees over {} px, allowed {} to {}: its focal length is for "
                  "another image size",
                  which, field_deg, length_px, kMinFieldDeg, kMaxFieldDeg);
    }
  }
  return CheckDistortion(camera, size, which);
}

// A rig has two lenses of one kind on sensors of one kind with square pixels.
Status CheckFocalLengths(const StereoCalibration& calibration) {
  constexpr double kMaxRatio = 1.15;
  const Eigen::Matrix3d& left = calibration.left.camera_matrix;
  const Eigen::Matrix3d& right = calibration.right.camera_matrix;
  const auto [least, most] = std::minmax({left(0, 0), left(1, 1), right(0, 0), right(1, 1)});
  if (!(most <= kMaxRatio * least)) {
    return Fail(
        ErrorCode::kInvalidArgument,
        "the focal lengths of the two cameras (x, y) are between {:.1f} and {:.1f} px, a factor of at "
        "most {} is allowed",
        least, most, kMaxRatio);
  }
  return {};
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
  RETURN_IF_ERROR(CheckFitsFrame(calibration.left, image_size, "left camera"));
  RETURN_IF_ERROR(CheckFitsFrame(calibration.right, image_size, "right camera"));
  RETURN_IF_ERROR(CheckFocalLengths(calibration));
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
  ASSIGN_OR_RETURN(rig.left_lines, EpipolarTable::Build(calibration.left, r1, p1, image_size));
  ASSIGN_OR_RETURN(rig.right_lines, EpipolarTable::Build(calibration.right, r2, p2, image_size));
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
