// Two rectified coordinate maps -> disparity of every left pixel.
#pragma once

#include <opencv2/core/mat.hpp>

#include "services/reconstruction/reconstruction_config.h"
#include "services/reconstruction/rectify_coordinates.h"
#include "services/reconstruction/stereo_rig.h"

namespace forgescan {

// Shape: rectified left image; NaN where there is none. Units: px, measured from the two principal points, so
// that depth = focal_px * baseline_mm / disparity.
struct DisparityMap {
  cv::Mat_<float> disparity_px;
  cv::Mat_<float> sigma_px;
  long candidates = 0;  // left pixels with a coordinate
  long no_partner = 0;
  long ambiguous = 0;   // more than one place fits
  long left_right = 0;  // there and back does not close
};

// Errors: kDegenerate when a view has no coordinate at all, when its coordinate does not change along rows
// (fringes run the wrong way), or when the two views' coordinates run in opposite directions.
Result<DisparityMap> MatchViews(const RectifiedView& left, const RectifiedView& right, const StereoRig& rig,
                                const ReconstructionConfig& config);

}  // namespace forgescan
