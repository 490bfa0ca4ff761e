// Checks a log against what its own opening and closing events say of it.
#pragma once

#include <map>
#include <set>
#include <string>
#include <vector>

#include "services/common/log/channel_totals.h"
#include "tools/forgescan/log/log_check.h"

namespace forgescan {

class ClosingCheck {
 public:
  // The recording outlives this.
  explicit ClosingCheck(const Recording& recording) : recording_(recording) {}

  // In file order.
  void Add(const LogEntry& entry, ByteView message, std::vector<LogFinding>& findings);
  void Finish(std::vector<LogFinding>& findings) const;
  // After the last Add(): channels of which the closing event says that something is missing, or counts
  // otherwise.
  std::set<std::string> DoubtfulChannels() const;

 private:
  struct Difference {
    std::string channel;
    std::string what;
  };
  std::vector<Difference> Differences() const;
  void CheckRecordedFile(const LogEntry& entry, ByteView message, std::vector<LogFinding>& findings);
  void FinishClosing(const fsmsg::recording_closed_t& closed, std::vector<LogFinding>& findings) const;

  const Recording& recording_;
  ChannelTotals totals_;  // before the closing event
  bool is_closed_ = false;
  std::int64_t after_closing_ = 0;  // events
  std::int64_t recorded_files_ = 0;
  std::map<std::int32_t, std::int8_t> verdicts_;  // by part
};

}  // namespace forgescan
