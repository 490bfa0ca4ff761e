// Checks the messages of a log one by one, and the order of their streams.
#pragma once

#include <map>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "services/common/bus/stream_header.h"
#include "tools/forgescan/log/log_check.h"

namespace forgescan {

class MessageCheck {
 public:
  // The recording outlives this.
  explicit MessageCheck(const Recording& recording);

  // In file order.
  void Add(const LogEntry& entry, ByteView message, std::vector<LogFinding>& findings);
  // What can be said at the end only. doubtful: channels whose holes are findings.
  void Finish(const std::set<std::string>& doubtful, std::vector<LogFinding>& findings) const;

 private:
  struct Unknown {
    std::int64_t events = 0;
    std::uint64_t first_offset = 0;
  };
  struct Stream {
    std::int64_t last = 0;
    std::vector<std::pair<std::int64_t, std::int64_t>> holes;  // first and last missing sequence
  };
  void AddToStream(const std::string& channel, const LogEntry& entry, const StreamHeader& header,
                   std::vector<LogFinding>& findings);

  const Recording& recording_;
  std::map<std::string, std::int64_t> announced_;                     // fingerprint by channel
  std::map<std::pair<std::string, std::uint64_t>, Unknown> unknown_;  // by channel and fingerprint
  std::map<std::pair<std::string, std::int64_t>, Stream> streams_;    // by channel and session
};

}  // namespace forgescan
