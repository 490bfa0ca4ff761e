#include "tools/forgescan/replay/recorded_session.h"

#include <algorithm>
#include <set>
#include <string_view>

#include "services/common/bus/channel_list.h"
#include "services/common/bus/channels.h"
#include "services/common/bus/codec.h"

namespace forgescan {
namespace {

bool IsAddition(std::string_view channel) {
  return channel == kRecordingOpened.name || channel == kRecordedFile.name ||
         channel == kRecordingClosed.name;
}

template <typename Message>
Result<Message> ReadAs(const LogReader& log, const LogEntry& entry) {
  ASSIGN_OR_RETURN(const Bytes bytes, log.Read(entry));
  Result<Message> message = Decode<Message>(bytes);
  return message.ok() ? std::move(message)
                      : Fail(ErrorCode::kFormat, "{}, event at byte {}: {}", log.path(), entry.offset,
                             message.error().message);
}

std::string Sentence(const LogReader& log, const fsmsg::recording_gap_t& gap) {
  return gap.first_sequence > 0 ? fmt::format("{}: {} {} to {} are missing: {}", log.path(), gap.channel,
                                              gap.first_sequence, gap.last_sequence, gap.reason)
                                : fmt::format("{}: {}: {}", log.path(), gap.channel, gap.reason);
}

}  // namespace

Result<RecordedSession> RecordedSession::Open(const std::vector<std::string>& paths) {
  RecordedSession session;
  for (const std::string& path : paths) {
    ASSIGN_OR_RETURN(LogReader log, LogReader::Open(path));
    RETURN_IF_ERROR(session.Add(std::move(log)));
  }
  RETURN_IF_ERROR(session.Merge());
  return session;
}

const std::string& RecordedSession::ChannelOf(const RecordedEvent& event) const {
  const LogReader& log = logs_[event.log];
  return log.ChannelOf(log.entries()[event.entry]);
}

Result<Bytes> RecordedSession::Read(const RecordedEvent& event) const {
  const LogReader& log = logs_[event.log];
  return log.Read(log.entries()[event.entry]);
}

Result<Bytes> RecordedSession::ReadStart(const RecordedEvent& event, std::size_t bytes) const {
  const LogReader& log = logs_[event.log];
  return log.Read(log.entries()[event.entry], bytes);
}

std::string RecordedSession::Where(const RecordedEvent& event) const {
  const LogReader& log = logs_[event.log];
  return fmt::format("{}, event {} at byte {}", log.path(), event.entry, log.entries()[event.entry].offset);
}

std::int64_t RecordedSession::duration_us() const {
  return events_.empty() ? 0 : events_.back().utime - events_.front().utime;
}

std::int64_t RecordedSession::LostBetween(const std::string& channel, const StreamHeader& before,
                                          const StreamHeader& after) const {
  std::int64_t lost = 0;
  for (const auto& gap : gaps_) {
    const bool between = gap.channel == channel && before.session == after.session &&
                         gap.session == after.session && gap.first_sequence > before.sequence &&
                         gap.last_sequence < after.sequence;
    lost += between ? gap.last_sequence - gap.first_sequence + 1 : 0;
  }
  return lost;
}

Status RecordedSession::Add(LogReader log) {
  bool opened = false, closed = false;
  for (const LogEntry& entry : log.entries()) {
    const std::string& channel = log.ChannelOf(entry);
    opened = opened || channel == kRecordingOpened.name;
    closed = closed || channel == kRecordingClosed.name;
    if (IsAddition(channel)) {
      RETURN_IF_ERROR(AddAddition(log, entry));
    }
  }
  if (!opened) {
    return Fail(ErrorCode::kFormat,
                "{} holds no {} event: it is not a recording of forgescan, and cannot be computed again",
                log.path(), kRecordingOpened.name);
  }
  for (const LogDamage& damage : log.damage()) {
    findings_.push_back(
        fmt::format("{}: {} bytes at byte {}: {}", log.path(), damage.bytes, damage.offset, damage.what));
  }
  if (!closed) {
    findings_.push_back(fmt::format("{}: the recording was not closed, its end is missing", log.path()));
  }
  logs_.push_back(std::move(log));
  return {};
}

Status RecordedSession::AddAddition(const LogReader& log, const LogEntry& entry) {
  const std::string& channel = log.ChannelOf(entry);
  if (channel == kRecordedFile.name) {
    ASSIGN_OR_RETURN(auto file, ReadAs<fsmsg::recorded_file_t>(log, entry));
    return AddFile(log, std::move(file));
  }
  if (channel == kRecordingClosed.name) {
    ASSIGN_OR_RETURN(const auto closed, ReadAs<fsmsg::recording_closed_t>(log, entry));
    for (const auto& gap : closed.gaps) {
      findings_.push_back(Sentence(log, gap));
      gaps_.push_back(gap);
    }
    return {};
  }
  ASSIGN_OR_RETURN(auto opened, ReadAs<fsmsg::recording_opened_t>(log, entry));
  if (!logs_.empty() && opened.station != opened_.station) {
    return Fail(ErrorCode::kInvalidArgument, "{} is of station {}, {} of station {}: replay them separately",
                log.path(), opened.station, logs_.front().path(), opened_.station);
  }
  if (logs_.empty()) {
    opened_ = std::move(opened);
    ASSIGN_OR_RETURN(types_, LcmTypes::Parse(opened_.types));
  }
  return {};
}

// Every recording brings the station's files; they have to be the same ones.
Status RecordedSession::AddFile(const LogReader& log, fsmsg::recorded_file_t file) {
  const auto known = std::find_if(files_.begin(), files_.end(),
                                  [&file](const auto& held) { return held.name == file.name; });
  if (known == files_.end()) {
    files_.push_back(std::move(file));
  } else if (known->data != file.data) {
    return Fail(ErrorCode::kInvalidArgument, "{} of {} is not that of {}: replay them separately", file.name,
                log.path(), logs_.empty() ? log.path() : logs_.front().path());
  }
  return {};
}

Status RecordedSession::Merge() {
  for (std::size_t log = 0; log < logs_.size(); ++log) {
    const auto& entries = logs_[log].entries();
    std::int64_t utime = 0;
    for (std::size_t i = 0; i < entries.size(); ++i) {
      utime = std::max(utime, entries[i].utime);
      if (!IsAddition(logs_[log].ChannelOf(entries[i]))) {
        events_.push_back({log, i, utime});
      }
    }
  }
  std::stable_sort(events_.begin(), events_.end(),
                   [](const auto& a, const auto& b) { return a.utime < b.utime; });
  if (logs_.size() == 1) {
    return {};
  }
  std::set<std::pair<std::string, Bytes>> states;  // small, and a second or less apart
  std::vector<RecordedEvent> once;
  for (const RecordedEvent& event : events_) {
    bool is_new = true;
    if (IsStateChannel(ChannelOf(event))) {
      ASSIGN_OR_RETURN(Bytes message, Read(event));
      is_new = states.emplace(ChannelOf(event), std::move(message)).second;
    }
    if (is_new) {
      once.push_back(event);
    }
  }
  events_ = std::move(once);
  return {};
}

}  // namespace forgescan
