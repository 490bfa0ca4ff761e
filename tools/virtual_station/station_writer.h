// Writes what the inspection services need to know about the virtual station, as its commissioning would have
// measured it:
//   calibration/stereo.yaml   pattern.toml   views/views.toml   model/axle.step, axle.stl, features.toml
#pragma once

#include <string>

#include "tools/virtual_station/cell_config.h"
#include "tools/virtual_station/pattern.h"

namespace forgescan {

// Makes the folders. Cost: about 3 s (the CAD model). Errors: kIo naming the path.
Status WriteStation(const CellConfig& config, ProjectedSet set, const std::string& directory);

// CRC-32 of the taught path, as the robot controller reports it: views are bound to it.
std::uint32_t PathCrc32(const std::vector<ViewConfig>& views);

}  // namespace forgescan
