// Absolute projector coordinates of a raw camera -> those of the rectified camera.
#pragma once

#include <opencv2/core/mat.hpp>

#include "services/reconstruction/decoded_view.h"
#include "services/reconstruction/reconstruction_config.h"

namespace forgescan {

// Shape: maps of the rectified image. NaN: this pixel has no coordinate.
struct RectifiedView {
  cv::Mat_<float> coordinate_px;
  cv::Mat_<float> sigma_px;
  double slope =
      0;  // typical change of the coordinate per camera pixel along a row, with sign; 0: no pixel at all
};

// Bilinear, and only where all four raw neighbours are valid and differ by no more than the largest slope
// allows: nothing is ever interpolated across a fringe-order error, an edge or a masked pixel. sigma assumes
// independent neighbours.
RectifiedView RectifyCoordinates(const DecodedView& view, const cv::Mat_<cv::Vec2f>& map,
                                 const ReconstructionConfig& config);

}  // namespace forgescan
