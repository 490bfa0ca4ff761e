// Scans of the cell without a part, out of recordings.
#pragma once

#include <string>
#include <vector>

#include "services/fusion/standing_surfaces.h"

namespace forgescan {

// One scan for each number of a part in a recording: the points of its views as the reconstruction published
// them, each view's last attempt. Errors: those of RecordedSession::Open for each log by itself; kUntrusted
// (a recording that is not whole; a scan in which the pyrometer saw a part), kInvalidArgument (another path
// or another calibration than `origin`'s), kNotFound (no points of a view). Each names the log.
Result<std::vector<std::vector<ViewCloud>>> ReadEmptyScans(const std::vector<std::string>& logs,
                                                           const StandingOrigin& origin);

}  // namespace forgescan
