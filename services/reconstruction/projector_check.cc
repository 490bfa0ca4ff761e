#include "services/reconstruction/projector_check.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

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

ProjectorCheck::ProjectorCheck(const ProjectorCalibration& projector, const ReconstructionConfig& config)
    : focal_px_(static_cast<float>(projector.intrinsics.camera_matrix(0, 0))),
      center_px_(static_cast<float>(projector.intrinsics.camera_matrix(0, 2))),
      distortion_{},
      max_residual_px_(static_cast<float>(config.max_projector_residual_px)),
      max_residual_sigma_(static_cast<float>(config.max_projector_residual_sigma)) {
  const auto& distortion = projector.intrinsics.distortion;
  for (std::size_t i = 0; i < std::min<std::size_t>(distortion.size(), 14); ++i) {
    distortion_[i] = static_cast<float>(distortion[i]);
  }
  CopyRows(projector.projector_from_left.rotation, rotation_);
  for (int i = 0; i < 3; ++i) {
    translation_mm_[i] = static_cast<float>(projector.projector_from_left.translation_mm(i));
  }
  const bool is_tilted = distortion.size() == 14;
  CopyRows(is_tilted ? Tilt(distortion[12], distortion[13]) : Eigen::Matrix3d::Identity(), tilt_);
}

ProjectorCheck::Image ProjectorCheck::Distorted(float x, float y) const {
  const float* const k = distortion_;
  const float s = x * x + y * y;
  const float radial = (1 + s * (k[0] + s * (k[1] + s * k[4]))) / (1 + s * (k[5] + s * (k[6] + s * k[7])));
  return {x * radial + 2 * k[2] * x * y + k[3] * (s + 2 * x * x) + s * (k[8] + s * k[9]),
          y * radial + k[2] * (s + 2 * y * y) + 2 * k[3] * x * y + s * (k[10] + s * k[11])};
}

float ProjectorCheck::ColumnOf(const float* p) const {
  const float* const r = rotation_;
  const float x = r[0] * p[0] + r[1] * p[1] + r[2] * p[2] + translation_mm_[0];
  const float y = r[3] * p[0] + r[4] * p[1] + r[5] * p[2] + translation_mm_[1];
  const float z = r[6] * p[0] + r[7] * p[1] + r[8] * p[2] + translation_mm_[2];
  const Image image = Distorted(x / z, y / z);
  const float u = tilt_[0] * image.x + tilt_[1] * image.y + tilt_[2];
  const float w = tilt_[6] * image.x + tilt_[7] * image.y + tilt_[8];
  return focal_px_ * (u / w) + center_px_;
}

int ProjectorCheck::Filter(PointRow& row, HistogramMedian& residuals_px) const {
  int kept = 0;
  for (int i = 0; i < row.count; ++i) {
    const float residual_px = row.coordinate_px[i] - ColumnOf(row.points_mm + 3 * i);
    residuals_px.Add(std::isnan(residual_px) ? kMaxResidualPx : static_cast<double>(residual_px));
    const float limit_px =
        std::max(max_residual_px_, max_residual_sigma_ * std::sqrt(row.coordinate_variance_px2[i]));
    std::copy_n(row.points_mm + 3 * i, 3, row.points_mm + 3 * kept);
    std::copy_n(row.normals + 3 * i, 3, row.normals + 3 * kept);
    row.sigma_mm[kept] = row.sigma_mm[i];
    row.coordinate_px[kept] = row.coordinate_px[i];
    kept += std::abs(residual_px) <= limit_px ? 1 : 0;
  }
  const int gone = row.count - kept;
  row.count = kept;
  return gone;
}

}  // namespace forgescan
