// What is left to do when all parts of a run are sorted: the truth beside the reports, and the run's outcome.
#pragma once

#include <filesystem>
#include <vector>

#include "services/common/bus/channels.h"
#include "services/common/result.h"

namespace forgescan {

// Whether the page of every part with a verdict is written, which the report service does when all services
// have said what they lost.
bool PagesAreWritten(const std::filesystem::path& results, const std::vector<fsmsg::verdict_t>& verdicts);

// Prints one line `report FOLDER` for every part that has a report, and copies its truth beside it; only now,
// when every service is done with the part. Errors, all in one sentence, after every part has had its turn:
// kUntrusted (a part was not inspected, or has no verdict, report or truth).
Status ShowOutcome(const std::filesystem::path& run, const std::filesystem::path& results,
                   const std::vector<fsmsg::verdict_t>& verdicts, int parts);

}  // namespace forgescan
