#include "tools/virtual_station/teaching.h"

#include <opencv2/calib3d.hpp>
#include <opencv2/core/eigen.hpp>

#include "tools/virtual_station/scene.h"

namespace forgescan {
namespace {

// Half the size of the volume in which the markers of a view lie: 300 x 200 x 40 mm about the working
// distance.
const Eigen::Vector3d kMarkerSpreadMm(150.0, 100.0, 20.0);

void Disturb(const CalibrationErrorConfig& error, double pixel_scale, RandomStream& random, Lens& lens) {
  lens.fx_px += pixel_scale * error.focal_sd_px * random.Gaussian();
  lens.fy_px += pixel_scale * error.focal_sd_px * random.Gaussian();
  lens.cx_px += pixel_scale * error.centre_sd_px * random.Gaussian();
  lens.cy_px += pixel_scale * error.centre_sd_px * random.Gaussian();
  lens.distortion[0] += error.k1_sd * random.Gaussian();
}

cv::Mat CameraMatrix(const Lens& lens) {
  return (cv::Mat_<double>(3, 3) << lens.fx_px, 0, lens.cx_px, 0, lens.fy_px, lens.cy_px, 0, 0, 1);
}

// As the reconstruction does it: both rays in the rectified frame, depth from their disparity.
Eigen::Vector3d Triangulate(const Rig& rig, const Rectification& rectification,
                            const Eigen::Vector2d& left_pixel, const Eigen::Vector2d& right_pixel) {
  const Eigen::Vector3d left =
      rectification.rectified_from_left * Unproject(rig.left.lens, left_pixel).homogeneous();
  const Eigen::Vector3d right =
      rectification.rectified_from_right * Unproject(rig.right.lens, right_pixel).homogeneous();
  const double disparity = left.x() / left.z() - right.x() / right.z();
  return left / left.z() * (rectification.baseline_mm / disparity);
}

// A projector is calibrated by the phases that the calibrated cameras see, so on average it agrees with them,
// right or wrong: its centre takes up the mean difference over the working volume.
void AgreeWithCameras(const Rig& truth, double working_distance_mm, Rig& calibrated) {
  const Rectification rectification = Rectify(calibrated);
  const Eigen::Isometry3d rig_from_rectified =
      calibrated.left.camera_from_rig.inverse() *
      Eigen::Isometry3d(rectification.rectified_from_left.transpose());
  Eigen::Vector2d sum_px(0.0, 0.0);
  int count = 0;
  for (const double x : {-1.0, -0.5, 0.0, 0.5, 1.0}) {
    for (const double y : {-1.0, -0.5, 0.0, 0.5, 1.0}) {
      const Eigen::Vector3d p_in_rig = Eigen::Vector3d(x, y, 0.0).cwiseProduct(kMarkerSpreadMm) +
                                       Eigen::Vector3d(0.0, 0.0, working_distance_mm);
      const Eigen::Vector2d left = Project(truth.left.lens, truth.left.camera_from_rig * p_in_rig);
      const Eigen::Vector2d right = Project(truth.right.lens, truth.right.camera_from_rig * p_in_rig);
      const Eigen::Vector3d seen = rig_from_rectified * Triangulate(calibrated, rectification, left, right);
      sum_px += Project(truth.projector.lens, truth.projector.camera_from_rig * p_in_rig) -
                Project(calibrated.projector.lens, calibrated.projector.camera_from_rig * seen);
      ++count;
    }
  }
  calibrated.projector.lens.cx_px += sum_px.x() / count;
  calibrated.projector.lens.cy_px += sum_px.y() / count;
}

CameraIntrinsics IntrinsicsOf(const Lens& lens) {
  CameraIntrinsics intrinsics;
  intrinsics.camera_matrix << lens.fx_px, 0, lens.cx_px, 0, lens.fy_px, lens.cy_px, 0, 0, 1;
  intrinsics.distortion.assign(lens.distortion.begin(), lens.distortion.end());
  return intrinsics;
}

Lens LensOf(const CameraIntrinsics& intrinsics) {
  const Eigen::Matrix3d& k = intrinsics.camera_matrix;
  Lens lens{k(0, 0), k(1, 1), k(0, 2), k(1, 2), {}};
  for (std::size_t i = 0; i < lens.distortion.size(); ++i) {
    lens.distortion[i] = i < intrinsics.distortion.size() ? intrinsics.distortion[i] : 0;
  }
  return lens;
}

PoseFromLeft PoseOf(const PinholeCamera& device, const PinholeCamera& left) {
  const Eigen::Isometry3d pose = device.camera_from_rig * left.camera_from_rig.inverse();
  return {pose.linear(), pose.translation()};
}

Eigen::Isometry3d FromRig(const PoseFromLeft& pose, const PinholeCamera& left) {
  Eigen::Isometry3d device_from_left = Eigen::Isometry3d::Identity();
  device_from_left.linear() = pose.rotation;
  device_from_left.translation() = pose.translation_mm;
  return device_from_left * left.camera_from_rig;
}

Eigen::Isometry3d TeachView(const CellConfig& config, const Rig& calibrated,
                            const Rectification& rectification, int view) {
  RandomStream visit(config.seed, RandomUse::kTeachingVisit, {view});
  RandomStream random(config.seed, RandomUse::kMarkers, {view});
  const ViewConfig& taught = config.views[static_cast<std::size_t>(view)];
  const Eigen::Isometry3d array_from_rig =
      TaughtRigPose(taught, config.working_distance_mm) *
      SmallMotion(visit, config.robot.position_sd_mm, config.robot.rotation_sd_rad);
  Eigen::Matrix3Xd p_in_rectified(3, config.robot.markers);
  Eigen::Matrix3Xd p_in_array(3, config.robot.markers);
  for (int i = 0; i < config.robot.markers; ++i) {
    Eigen::Vector3d p_in_rig(0.0, 0.0, config.working_distance_mm);
    Eigen::Vector3d noise_mm;
    for (int axis = 0; axis < 3; ++axis) {
      p_in_rig(axis) += kMarkerSpreadMm(axis) * random.Uniform(-1.0, 1.0);
      noise_mm(axis) = config.robot.marker_sd_mm * random.Gaussian();
    }
    const Eigen::Vector2d left = Project(config.rig.left.lens, config.rig.left.camera_from_rig * p_in_rig);
    const Eigen::Vector2d right = Project(config.rig.right.lens, config.rig.right.camera_from_rig * p_in_rig);
    p_in_rectified.col(i) = Triangulate(calibrated, rectification, left, right) + noise_mm;
    p_in_array.col(i) = array_from_rig * p_in_rig;
  }
  Eigen::Isometry3d array_from_camera;
  array_from_camera.matrix() = Eigen::umeyama(p_in_rectified, p_in_array, false);
  return array_from_camera;
}

}  // namespace

Rig CalibratedRig(const CellConfig& config) {
  RandomStream random(config.seed, RandomUse::kCalibration);
  const CalibrationErrorConfig& error = config.calibration_error;
  Rig rig = config.rig;
  // Errors are stated for the full image of 2448 px; a scaled image has them scaled.
  const double scale = rig.left.width_px / 2448.0;
  Disturb(error, scale, random, rig.left.lens);
  Disturb(error, scale, random, rig.right.lens);
  Disturb(error, 1.0, random, rig.projector.lens);
  for (PinholeCamera* device : {&rig.right, &rig.projector}) {
    device->camera_from_rig =
        SmallMotion(random, error.translation_sd_mm, error.rotation_sd_rad) * device->camera_from_rig;
  }
  AgreeWithCameras(config.rig, config.working_distance_mm, rig);
  return rig;
}

StereoCalibration CalibrationOf(const Rig& rig) {
  StereoCalibration calibration{IntrinsicsOf(rig.left.lens),
                                IntrinsicsOf(rig.right.lens),
                                PoseOf(rig.right, rig.left),
                                ImageSize{rig.left.width_px, rig.left.height_px},
                                {}};
  calibration.projector = {IntrinsicsOf(rig.projector.lens), PoseOf(rig.projector, rig.left)};
  return calibration;
}

Rig WithCalibration(Rig rig, const StereoCalibration& calibration) {
  rig.left.lens = LensOf(calibration.left);
  rig.right.lens = LensOf(calibration.right);
  rig.right.camera_from_rig = FromRig(calibration.right_from_left, rig.left);
  if (calibration.projector) {
    rig.projector.lens = LensOf(calibration.projector->intrinsics);
    rig.projector.camera_from_rig = FromRig(calibration.projector->projector_from_left, rig.left);
  }
  return rig;
}

Rectification Rectify(const Rig& rig) {
  const Eigen::Isometry3d right_from_left = rig.right.camera_from_rig * rig.left.camera_from_rig.inverse();
  cv::Mat r, t, r1, r2, p1, p2, q;
  cv::eigen2cv(Eigen::Matrix3d(right_from_left.linear()), r);
  cv::eigen2cv(Eigen::Vector3d(right_from_left.translation()), t);
  const cv::Mat left_distortion(1, 5, CV_64F, const_cast<double*>(rig.left.lens.distortion.data()));
  const cv::Mat right_distortion(1, 5, CV_64F, const_cast<double*>(rig.right.lens.distortion.data()));
  cv::stereoRectify(CameraMatrix(rig.left.lens), left_distortion, CameraMatrix(rig.right.lens),
                    right_distortion, cv::Size(rig.left.width_px, rig.left.height_px), r, t, r1, r2, p1, p2,
                    q);
  Rectification rectification;
  cv::cv2eigen(r1, rectification.rectified_from_left);
  cv::cv2eigen(r2, rectification.rectified_from_right);
  rectification.baseline_mm = right_from_left.translation().norm();
  return rectification;
}

std::vector<Eigen::Isometry3d> TeachViews(const CellConfig& config, const Rig& calibrated) {
  const Rectification rectification = Rectify(calibrated);
  std::vector<Eigen::Isometry3d> array_from_camera;
  for (std::size_t i = 0; i < config.views.size(); ++i) {
    array_from_camera.push_back(TeachView(config, calibrated, rectification, static_cast<int>(i)));
  }
  return array_from_camera;
}

}  // namespace forgescan
