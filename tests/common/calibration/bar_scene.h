// A rig of known truth, a calibration of it that is wrong, and a ball bar as that calibration measures it.
#pragma once

#include <array>
#include <span>
#include <string>
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

// The file of these placements, with the volume of BarPlaces; U = 0.001 mm, balls of 19.05 mm.
std::string PlacementsText(std::span<const BarPlacement> placements, double distance_mm);

RefinementOptions BarOptions();

}  // namespace forgescan
