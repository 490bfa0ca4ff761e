// One camera's frames of a known coordinate map, at any size: truth for the decoder without a stereo rig.
#pragma once

#include <cstdint>
#include <functional>
#include <opencv2/core/mat.hpp>
#include <vector>

#include "services/reconstruction/pattern_set.h"
#include "services/reconstruction/reconstruction_config.h"

namespace forgescan {

// 64, 63 and 56 fringes on 1984 px, the projector 1920 px wide. shared: 2-3-2 frames, the three-frame block
// in the middle and on the finest fringes; own: 4-4-4. A plain white frame comes last in both.
PatternSet StationPattern(Background background);

struct PhaseLighting {
  double background_dn = 110;
  double modulation_dn = 80;
  CameraNoise noise{.read_noise_dn = 1, .gain_dn = 0};
  double drift_dn = 0;  // of the background from one frame to the next, linear in time
  std::uint64_t seed = 1;
};

// What lights each pixel: projector column, px; NaN where no fringe falls.
using Columns = cv::Mat_<double>;

// Frames in order of projection; the background drifts by frame index times drift_dn. white is A + B /
// contrast, mid_grey is A. type: CV_8UC1 (rounded to whole grey values) or CV_16UC1 (257 times the 8-bit
// value).
std::vector<cv::Mat> RenderColumns(const Columns& columns, const PatternSet& pattern,
                                   const PhaseLighting& lighting, int type = CV_8UC1);

// A scene of a camera of the station: sloped, waved, with a step of 25 px, a rim and a disc without fringes,
// and a modulation of 55 to 85 DN that varies over the image.
struct StationScene {
  Columns columns;
  cv::Mat_<float> modulation_dn;
  cv::Mat_<float> background_dn;
  std::vector<cv::Mat> frames;
};
StationScene RenderStation(cv::Size size, const PatternSet& pattern, const CameraNoise& noise);

}  // namespace forgescan
