// The times of a recording's events, held against each other and against the messages' own.
#pragma once

#include <cstdint>
#include <vector>

#include "services/common/log/log_reader.h"
#include "tools/forgescan/log/log_check.h"

namespace forgescan {

struct EventTimes {
  std::vector<std::int64_t> utimes;  // us since 1970 UTC, of every event; never decreasing
  std::vector<LogFinding> findings;  // times that are minutes off, each replaced by its neighbour's
};

// For recordings of the recorder, whose messages begin with their time. Errors: kIo.
Result<EventTimes> CheckEventTimes(const LogReader& log);

}  // namespace forgescan
