// A log as LCM's own reader sees it, so that what we write is held against the format and not against
// ourselves.
#pragma once

#include <string>
#include <vector>

#include "services/common/bus/bus.h"

namespace forgescan::testing {

struct LogEvent {
  std::int64_t number = 0;
  std::int64_t utime = 0;
  std::string channel;
  Bytes message;
  bool operator==(const LogEvent&) const = default;
};

// Up to the first thing that is no event. A file that cannot be opened fails the test.
std::vector<LogEvent> ReadLog(const std::string& path);

}  // namespace forgescan::testing
