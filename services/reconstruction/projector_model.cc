#include "services/reconstruction/projector_model.h"

#include <Eigen/Geometry>
#include <algorithm>

namespace forgescan {
namespace {

// OpenCV's model of a tilted sensor.
Eigen::Matrix3d Tilt(double about_x, double about_y) {
  const Eigen::Matrix3d rotation = Eigen::AngleAxisd(-about_y, Eigen::Vector3d::UnitY()).toRotationMatrix() *
                                   Eigen::AngleAxisd(-about_x, Eigen::Vector3d::UnitX()).toRotationMatrix();
  Eigen::Matrix3d onto = Eigen::Matrix3d::Identity();
  onto << rotation(2, 2), 0, -rotation(0, 2), 0, rotation(2, 2), -rotation(1, 2), 0, 0, 1;
  return onto * rotation;
}

void CopyRows(const Eigen::Matrix3d& from, float (&to)[9]) {
  for (int i = 0; i < 9; ++i) {
    to[i] = static_cast<float>(from(i / 3, i % 3));
  }
}

}  // namespace

ProjectorModel MakeProjectorModel(const ProjectorCalibration& projector, const ReconstructionConfig& config) {
  ProjectorModel model = {};
  const auto& distortion = projector.intrinsics.distortion;
  for (std::size_t i = 0; i < std::min<std::size_t>(distortion.size(), 12); ++i) {
    model.distortion[i] = static_cast<float>(distortion[i]);
  }
  CopyRows(projector.projector_from_left.rotation, model.rotation);
  for (int i = 0; i < 3; ++i) {
    model.translation_mm[i] = static_cast<float>(projector.projector_from_left.translation_mm(i));
  }
  const bool is_tilted = distortion.size() == 14;
  CopyRows(is_tilted ? Tilt(distortion[12], distortion[13]) : Eigen::Matrix3d::Identity(), model.tilt);
  model.focal_px = static_cast<float>(projector.intrinsics.camera_matrix(0, 0));
  model.center_px = static_cast<float>(projector.intrinsics.camera_matrix(0, 2));
  model.max_residual_px = static_cast<float>(config.max_projector_residual_px);
  model.max_residual_sigma = static_cast<float>(config.max_projector_residual_sigma);
  return model;
}

}  // namespace forgescan
