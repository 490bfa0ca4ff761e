// A small stereo rig with a projector that looks at a surface of known shape: frames with known truth.
#pragma once

#include <Eigen/Core>
#include <functional>
#include <opencv2/core/mat.hpp>
#include <optional>
#include <vector>

#include "services/common/imaging/stereo_calibration.h"
#include "services/reconstruction/pattern_set.h"

namespace forgescan {

struct Ray {
  Eigen::Vector3d origin_in_left;
  Eigen::Vector3d direction_in_left;
};
// Where a ray meets the surface, in the raw left camera's frame, mm.
using Surface = std::function<std::optional<Eigen::Vector3d>(const Ray&)>;

Surface Plane(const Eigen::Vector3d& normal, double offset_mm);
Surface Sphere(const Eigen::Vector3d& center_mm, double radius_mm);

// 320 x 240 px, f 600 px, both lenses distorted, baseline 120 mm, working distance 400 mm, projector 512 px
// wide.
StereoCalibration SmallRig();
// Three frequencies over 512 px; own: four frames each; shared: 3-2-2.
PatternSet SmallPattern(Background background);

struct Lighting {
  double background_dn = 110;
  double modulation_dn = 80;
  double noise_dn = 0;         // standard deviation of each grey value
  double second_harmonic = 0;  // over the first
  unsigned seed = 1;
};

struct StereoFrames {
  std::vector<cv::Mat> left;
  std::vector<cv::Mat> right;
};

StereoFrames Render(const Surface& surface, const StereoCalibration& rig, const PatternSet& pattern,
                    const Lighting& lighting);

}  // namespace forgescan
