// A ball bar with a certificate, and where it stood.
#pragma once

#include <Eigen/Core>
#include <array>
#include <string>

namespace forgescan {

// Two balls whose distance a laboratory certified. Lengths at the temperature the bar had. Units: mm.
struct BallBar {
  double distance_mm = 0;        // of the centres
  double distance_sigma_mm = 0;  // its standard uncertainty: the certificate's U over its k
  double ball_radius_mm = 0;
};

// The bar as it was measured at one place.
struct BarPlacement {
  std::string name;
  std::array<Eigen::Vector3d, 2> center_in_camera;  // mm, rectified left camera of the present calibration
  double center_sigma_mm = 0;  // of a coordinate of a centre: repeatability, not the calibration's errors

  double DistanceMm() const { return (center_in_camera[1] - center_in_camera[0]).norm(); }
};

}  // namespace forgescan
