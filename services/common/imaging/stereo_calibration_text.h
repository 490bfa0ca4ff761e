// A stereo calibration as the text of its file.
#pragma once

#include <string>

#include "services/common/imaging/stereo_calibration.h"

namespace forgescan {

// What LoadStereoCalibration() reads, as OpenCV writes YAML; every number with all its digits.
std::string StereoCalibrationText(const StereoCalibration& calibration);

}  // namespace forgescan
