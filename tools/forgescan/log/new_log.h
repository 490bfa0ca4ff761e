// A log made from another one. It must not exist, appears under its name only when it is complete, and its
// closing event names what the source lacked and what was left out.
#pragma once

#include <map>
#include <string>
#include <utility>
#include <vector>

#include "services/common/log/channel_totals.h"
#include "services/common/log/log_writer.h"
#include "tools/forgescan/log/recording.h"

namespace forgescan {

// Removes what it wrote unless it is closed.
class NewLog {
 public:
  // source: outlives this. Errors: as LogWriter::Create().
  static Result<NewLog> Create(const Recording& source, const std::string& path);
  NewLog(NewLog&& other) noexcept;
  NewLog& operator=(NewLog&&) = delete;
  ~NewLog();

  std::int64_t events() const { return writer_.events(); }
  Status Copy(const LogEntry& entry, ByteView message);
  // Something that the new log lacks, besides what the source says it lacks and its damage.
  void AddGap(const std::string& channel, const std::string& reason);
  // With the closing event.
  Status Close(const std::string& reason);

 private:
  // Channels that were copied with all their events and yet are not what the source's closing event counted:
  // a bit is wrong somewhere, and a new count must not hide it.
  void AddChangedChannels();
  NewLog(const Recording& source, LogWriter writer);
  // At most as many as a closing event holds.
  std::vector<fsmsg::recording_gap_t> ShortGaps() const;

  const Recording& source_;
  LogWriter writer_;
  ChannelTotals totals_;
  std::map<std::int32_t, std::int8_t> verdicts_;  // by part, of the messages copied
  std::vector<fsmsg::recording_gap_t> gaps_;
  std::int64_t last_utime_ = 0;  // of the last event copied
  bool is_open_ = true;
};

}  // namespace forgescan
