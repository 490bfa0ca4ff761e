// Whether a log is whole and complete, and if not, where not.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "tools/forgescan/log/recording.h"

namespace forgescan {

struct LogFinding {
  std::optional<std::uint64_t> offset;  // in the file; nothing = the file as a whole
  std::string channel;                  // empty = none
  std::string what;                     // one clause
};

// Reads everything: damage, a recording's times, types, decoding, CRC and order of every stream, the
// recording's opening and closing events against what is there. A file of one part lacks what belongs to
// others, so a hole in the sequence of a stream is a finding only if the closing event names the channel's
// gaps or other totals. By place in the file, findings about the whole last. Errors: kIo.
Result<std::vector<LogFinding>> CheckLog(const Recording& recording);

}  // namespace forgescan
