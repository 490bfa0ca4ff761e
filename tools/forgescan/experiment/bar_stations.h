// How often a ball bar mends the calibration of a station, over many stations.
#pragma once

#include "tools/virtual_station/cell_config.h"

namespace forgescan {

// Shares of the stations.
struct BarStations {
  double within_before = 0,
         within_after = 0;  // whose calibration alone errs less than the limit for the pair
  double refused = 0;       // the refinement said no
};

// Stations 1, 2, ... are the cell with these seeds: their calibrations, bars with their certificates' errors,
// placements and errors of centres, computed by rays without images. The calibrations err in the 16
// parameters that are refined, and the projector; p1, p2 and what else a lens has are right.
BarStations RefineStations(CellConfig config, int stations, double limit_mm);

}  // namespace forgescan
