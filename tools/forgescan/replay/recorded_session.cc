#include "tools/forgescan/replay/recorded_session.h"

#include <algorithm>
#include <map>
#include <set>
#include <string_view>
#include <tuple>

#include "services/common/bus/channel_list.h"
#include "services/common/bus/channels.h"
#include "services/common/bus/codec.h"
#include "tools/forgescan/log/closing_check.h"
#include "tools/forgescan/log/event_times.h"

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

// What the recording says of itself against what there is. Errors: kIo.
Result<std::vector<std::string>> FindingsOf(const Recording& recording) {
  const LogReader& log = recording.log;
  std::vector<std::string> sentences;
  for (const LogDamage& damage : log.damage()) {
    sentences.push_back(
        fmt::format("{}: {} bytes at byte {}: {}", log.path(), damage.bytes, damage.offset, damage.what));
  }
  ClosingCheck check(recording);
  ASSIGN_OR_RETURN(EventTimes times, CheckEventTimes(log));
  std::vector<LogFinding> findings = std::move(times.findings);
  for (const LogEntry& entry : log.entries()) {
    ASSIGN_OR_RETURN(const Bytes message, log.Read(entry));
    check.Add(entry, message, findings);
  }
  check.Finish(findings);
  for (const LogFinding& finding : findings) {
    const std::string where = finding.offset.has_value() ? fmt::format(", byte {}", *finding.offset) : "";
    sentences.push_back(fmt::format("{}{}: {} {}", log.path(), where, finding.channel, finding.what));
  }
  return sentences;
}

}  // namespace

Result<RecordedSession> RecordedSession::Open(const std::vector<std::string>& paths) {
  RecordedSession session;
  for (const std::string& path : paths) {
    ASSIGN_OR_RETURN(Recording recording, OpenRecording(path));
    RETURN_IF_ERROR(session.Add(std::move(recording)));
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

Status RecordedSession::Add(Recording&& recording) {
  const LogReader& log = recording.log;
  if (!recording.opened.has_value()) {
    return Fail(ErrorCode::kFormat,
                "{} holds no {} event: it is not a recording of forgescan, and cannot be computed again",
                log.path(), kRecordingOpened.name);
  }
  for (const LogEntry& entry : log.entries()) {
    if (IsAddition(log.ChannelOf(entry))) {
      RETURN_IF_ERROR(AddAddition(log, entry));
    }
  }
  ASSIGN_OR_RETURN(const auto findings, FindingsOf(recording));
  findings_.insert(findings_.end(), findings.begin(), findings.end());
  logs_.push_back(std::move(recording.log));
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
    gaps_.insert(gaps_.end(), closed.gaps.begin(), closed.gaps.end());
    return {};
  }
  ASSIGN_OR_RETURN(auto opened, ReadAs<fsmsg::recording_opened_t>(log, entry));
  if (!logs_.empty() && opened.station != opened_.station) {
    return Fail(ErrorCode::kInvalidArgument, "{} is of station {}, {} of station {}: replay them separately",
                log.path(), opened.station, logs_.front().path(), opened_.station);
  }
  if (logs_.empty()) {
    opened_ = std::move(opened);
    auto types = LcmTypes::Parse(opened_.types);
    if (!types.ok()) {
      return Fail(ErrorCode::kFormat, "{}: its message types: {}", log.path(), types.error().message);
    }
    types_ = std::move(*types);
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
    RETURN_IF_ERROR(AddEvents(log));
  }
  std::stable_sort(events_.begin(), events_.end(),
                   [](const auto& a, const auto& b) { return a.utime < b.utime; });
  if (logs_.size() == 1) {
    return {};
  }
  RETURN_IF_ERROR(RefuseMessagesHeldTwice());
  return LeaveOutStatesHeldTwice();
}

Status RecordedSession::AddEvents(std::size_t log) {
  const LogReader& reader = logs_[log];
  ASSIGN_OR_RETURN(const EventTimes times, CheckEventTimes(reader));
  for (std::size_t i = 0; i < times.utimes.size(); ++i) {
    if (!IsAddition(reader.ChannelOf(reader.entries()[i]))) {
      events_.push_back({log, i, times.utimes[i]});
    }
  }
  return {};
}

// Parts that overlap share states, no messages of streams.
Status RecordedSession::RefuseMessagesHeldTwice() const {
  std::map<std::tuple<std::string, std::int64_t, std::int64_t>, std::size_t> held;  // to the log
  for (const RecordedEvent& event : events_) {
    const std::string& channel = ChannelOf(event);
    if (IsStateChannel(channel)) {
      continue;
    }
    ASSIGN_OR_RETURN(const Bytes start, ReadStart(event, kStreamHeaderBytes));
    const auto header = ReadStreamHeader(start);
    if (!header.ok()) {
      continue;  // found out when it is used
    }
    const auto [known, is_new] =
        held.emplace(std::tuple(channel, header->session, header->sequence), event.log);
    if (!is_new && known->second != event.log) {
      return Fail(ErrorCode::kInvalidArgument,
                  "{} and {} hold the same message, {} {}: give each recording once",
                  logs_[known->second].path(), logs_[event.log].path(), channel, header->sequence);
    }
  }
  return {};
}

Status RecordedSession::LeaveOutStatesHeldTwice() {
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
