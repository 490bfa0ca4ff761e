// The ceramic ball pair in front of the virtual cell's cameras.
#pragma once

#include <array>

#include "tools/virtual_station/virtual_cell.h"

namespace forgescan {

inline constexpr double kBallDistanceMm = 150.124;  // the paper's pair
inline constexpr double kBallRadiusMm = 19.05;      // of its own choice: the paper does not say

// Centres in the array frame, mm: aslant to the axes of the camera, about its working point.
std::array<Eigen::Vector3d, 2> BallCenters();

// The cell with one view, of the pair on a plate, instead of the axle's. White, without the texture of scale.
CellConfig BallCell(CellConfig config);

// Both balls as a part; chord error 0.0004 mm.
PartState BallPart();

// The distance of the centres as cameras without noise would find it by the calibration that commissioning
// wrote: the calibration's own share of the error, which stays the same from scan to scan. Units: mm.
double DistanceByCalibration(const CellConfig& config);

}  // namespace forgescan
