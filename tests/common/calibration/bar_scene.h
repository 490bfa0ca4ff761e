// A rig of known truth, a calibration of it that is wrong, and a ball bar as that calibration measures it.
#pragma once

#include <vector>

#include "services/common/calibration/refine_calibration.h"

namespace forgescan {

// Two converging 5 MP cameras 250 mm apart and a projector between them, 650 mm from the middle of the field.
StereoCalibration TrueRig();

// Off by the bar's kind of errors: scale, perspective and what no length shows.
RigVector SomeError();

// 16 places in a volume of 240 x 240 x 160 mm, rectified left camera of the true rig, mm.
std::vector<std::array<Eigen::Vector3d, 2>> BarPlaces(double distance_mm);

// The bar as the calibration measures it. Noise: standard deviation of each coordinate.
std::vector<BarPlacement> MeasuredBar(const StereoCalibration& calibration, double distance_mm,
                                      double noise_mm);

RefinementOptions BarOptions();

}  // namespace forgescan
