// How a point of a view scatters, in all directions.
#pragma once

#include <Eigen/Core>

namespace forgescan {

// Covariance, mm^2, of a point at p_in_camera (rectified left camera, mm, z > 0). sigma_mm: what the cloud
// says of it, along its view ray: the noise of the disparity. pixel_sigma_px: how well the ray itself is
// known, per axis of the rectified image: the rest of the calibration, 0.02 to 0.1 px as a rule. The two are
// independent: a disparity is that of a given ray. First order: p = f b / d (x, y, 1), dp/dd = -p / d, dp/du
// = z / f (1, 0, 0). Nothing needs to be stored for it but sigma_mm.
inline Eigen::Matrix3d PointCovariance(const Eigen::Vector3d& p_in_camera, double sigma_mm,
                                       double pixel_sigma_px, double focal_px) {
  const Eigen::Vector3d ray = p_in_camera.normalized();
  Eigen::Matrix3d covariance = sigma_mm * sigma_mm * (ray * ray.transpose());
  const double across_mm = pixel_sigma_px * p_in_camera.z() / focal_px;
  covariance(0, 0) += across_mm * across_mm;
  covariance(1, 1) += across_mm * across_mm;
  return covariance;
}

}  // namespace forgescan
