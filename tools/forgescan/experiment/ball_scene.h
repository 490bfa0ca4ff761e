// The ceramic ball pair and the ball bar in front of the virtual cell's cameras.
#pragma once

#include <array>
#include <span>
#include <vector>

#include "services/common/calibration/ball_bar.h"
#include "services/common/imaging/stereo_calibration.h"
#include "tools/virtual_station/virtual_cell.h"

namespace forgescan {

inline constexpr double kBallDistanceMm = 150.124;  // the paper's pair
inline constexpr double kBallRadiusMm = 19.05;      // of its own choice: the paper does not say
inline constexpr double kBarDistanceMm = 125.0;     // of the bar that refines the calibration, nominal

using BallPair = std::array<Eigen::Vector3d, 2>;

// The cell with one view, corner-on to the array's axes, of the pair among six cold blocks of 30 mm, instead
// of the axle's. White, without the texture of scale.
CellConfig BallCell(CellConfig config);

// The same without the blocks: what a bar is held in does not show.
CellConfig BarCell(CellConfig config);

// Centres of the pair in the array frame of BallCell, mm: aslant to the axes of the camera, about its working
// point.
BallPair PairCenters(const CellConfig& config);

// Where the bar is held, by hand: in the middle of the volume, at its sides, near and far, level and tilted.
// Frame and units: as PairCenters. distance_mm: its true one.
std::vector<BallPair> BarPlacements(const CellConfig& config, double distance_mm);

// Cold balls there, or none, as a part; chord error 0.0004 mm.
PartState BallPart(std::span<const Eigen::Vector3d> centers);

// The centres as cameras without noise would find them by a calibration of the rig. Frames: array in,
// rectified left camera of that calibration out. Units: mm.
BallPair SeenBy(const StereoCalibration& calibration, const CellConfig& config, const BallPair& in_array);

}  // namespace forgescan
