// What the services are not told: written beside a run, to judge their results by.
#pragma once

#include <string>

#include "tools/virtual_station/virtual_cell.h"

namespace forgescan {

// truth.json of one part: the five dimensions at the reference temperature and against their limits, how the
// part lay, and for the last visit of every view its time, temperatures, thermal scale and the robot's error.
// The file appears complete or not. Errors: kIo, and as VirtualCell::View.
Status WriteTruth(const CellConfig& config, const PartState& part, const std::vector<ViewState>& views,
                  const std::string& path);
// The same with all views at the times the configuration plans for them.
Status WriteTruth(const VirtualCell& cell, const PartState& part, const std::string& path);

}  // namespace forgescan
