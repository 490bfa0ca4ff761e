// One or several recordings of a station as one session: their events in order of recording, the station's
// files as they were, and what the recordings themselves say is missing.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "fsmsg/recorded_file_t.hpp"
#include "fsmsg/recording_gap_t.hpp"
#include "fsmsg/recording_opened_t.hpp"
#include "services/common/bus/stream_header.h"
#include "services/common/log/lcm_type.h"
#include "services/common/log/log_reader.h"
#include "services/common/result.h"

namespace forgescan {

struct Recording;

struct RecordedEvent {
  std::size_t log = 0;     // which recording
  std::size_t entry = 0;   // which event of it
  std::int64_t utime = 0;  // us since 1970 UTC of recording; never decreases from event to event
};

class RecordedSession {
 public:
  // Reads everything once, to hold it against what the recordings say of themselves. Errors: as
  // LogReader::Open; kFormat (a log without RECORDING_OPENED: not a recording of forgescan); kInvalidArgument
  // (recordings of different stations or with different files: each has to be replayed by itself; recordings
  // that hold the same message).
  static Result<RecordedSession> Open(const std::vector<std::string>& paths);

  // Events of the bus, without what the recorder added. A state message that several recordings hold is there
  // once.
  const std::vector<RecordedEvent>& events() const { return events_; }
  const std::string& ChannelOf(const RecordedEvent& event) const;
  Result<Bytes> Read(const RecordedEvent& event) const;
  // At most the first `bytes` of the message.
  Result<Bytes> ReadStart(const RecordedEvent& event, std::size_t bytes) const;
  // "FILE, event 12 at byte 345"
  std::string Where(const RecordedEvent& event) const;

  const fsmsg::recording_opened_t& opened() const { return opened_; }
  // The message types as they were when the session was recorded.
  const LcmTypes& types() const { return types_; }
  const std::vector<fsmsg::recorded_file_t>& files() const { return files_; }
  // How many messages of a channel the recordings lost between two that they hold.
  std::int64_t LostBetween(const std::string& channel, const StreamHeader& before,
                           const StreamHeader& after) const;
  // Why the session is not whole, one sentence each: damage, no closing event, gaps, counts and checksums of
  // the closing event or the station's files, times that cannot be. Empty = whole.
  const std::vector<std::string>& findings() const { return findings_; }
  std::int64_t duration_us() const;

 private:
  Status Add(Recording&& recording);
  Status AddAddition(const LogReader& log, const LogEntry& entry);
  Status AddFile(const LogReader& log, fsmsg::recorded_file_t file);
  Status Merge();
  // The events of one log in its order.
  Status AddEvents(std::size_t log);
  Status LeaveOutStatesHeldTwice();
  Status RefuseMessagesHeldTwice() const;

  std::vector<LogReader> logs_;
  std::vector<RecordedEvent> events_;
  fsmsg::recording_opened_t opened_{};
  LcmTypes types_;
  std::vector<fsmsg::recorded_file_t> files_;
  std::vector<fsmsg::recording_gap_t> gaps_;
  std::vector<std::string> findings_;
};

}  // namespace forgescan
