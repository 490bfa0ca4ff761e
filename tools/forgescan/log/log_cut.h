// A new log with a part of an old one.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "services/common/result.h"

namespace forgescan {

struct LogCut {
  std::string file, out;
  std::optional<std::string> from, to;  // us since 1970, or +SECONDS after the first event; none = no limit
  std::vector<std::string> channels;    // regular expressions; none = all channels
  std::optional<int> part, view;        // messages with other numbers, or without any, are left out
};

// Copies the events that meet every condition, and always the opening event with the station's files. Errors:
// kInvalidArgument (a time or an expression that is none; no event is left), as LogReader::Open() and
// LogWriter.
Status CutLog(const LogCut& cut);

}  // namespace forgescan
