// A log opened together with what is needed to understand it.
#pragma once

#include <optional>
#include <string>

#include "fsmsg/recording_closed_t.hpp"
#include "fsmsg/recording_opened_t.hpp"
#include "services/common/log/lcm_type.h"
#include "services/common/log/log_reader.h"

namespace forgescan {

struct Recording {
  LogReader log;
  // Of the log itself if it has them, else those this program was built with.
  LcmTypes types;
  std::string types_problem;  // why the log's own types cannot be used, one clause, else empty
  std::optional<fsmsg::recording_opened_t> opened;
  std::optional<fsmsg::recording_closed_t> closed;
};

// Errors: as LogReader::Open(); what the log lacks is no error.
Result<Recording> OpenRecording(const std::string& path);

// What a recording says it lacks, one clause: the messages as far as they are known, and why.
std::string GapText(const fsmsg::recording_gap_t& gap);

// OK, NOT_OK, ... for verdict_t.VERDICT_*.
std::string VerdictName(int verdict);

// A time, us since 1970 UTC, as 2016-10-27 14:00:00.123 UTC.
std::string TimeText(std::int64_t utime);

}  // namespace forgescan
