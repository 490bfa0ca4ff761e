#include "tools/forgescan/replay/result_comparison.h"

#include <algorithm>

#include "services/common/bus/stream_header.h"
#include "tools/forgescan/replay/message_text.h"

namespace forgescan {

std::string NotAsSent(const RecordedSession& session, const RecordedEvent& event, ByteView message,
                      const Error& error) {
  return fmt::format("{}: {} is not as it was sent: {}", session.Where(event),
                     MessageTitle(session.types(), session.ChannelOf(event), message), error.message);
}

Result<ResultComparison> ResultComparison::Create(const RecordedSession& session,
                                                  const std::vector<std::string>& channels) {
  ResultComparison comparison(session);
  for (const std::string& channel : channels) {
    comparison.channels_[channel] = {};
  }
  for (const RecordedEvent& event : session.events()) {
    const std::string& channel = session.ChannelOf(event);
    if (!comparison.channels_.contains(channel)) {
      continue;
    }
    ASSIGN_OR_RETURN(const Bytes start, session.ReadStart(event, kStreamHeaderBytes));
    const auto utime = StreamUtime(start);
    if (!utime.ok()) {
      comparison.changed_records_.push_back(NotAsSent(session, event, start, utime.error()));
      ++comparison.channels_[channel].missing;  // there was a result
      continue;
    }
    comparison.recorded_[{channel, *utime}].push_back(event);
  }
  return comparison;
}

Status ResultComparison::Add(const std::string& channel, ByteView replayed) {
  const auto utime = StreamUtime(replayed);
  if (!utime.ok()) {
    return utime.error();
  }
  const Moment moment{channel, *utime};
  const std::size_t index = replayed_[moment]++;
  const auto recorded = recorded_.find(moment);
  if (recorded == recorded_.end() || index >= recorded->second.size()) {
    ++channels_[channel].extra;
    return {};
  }
  return Compare(recorded->second[index], channel, replayed);
}

Status ResultComparison::Compare(const RecordedEvent& event, const std::string& channel, ByteView replayed) {
  ASSIGN_OR_RETURN(Bytes recorded, session_->Read(event));
  const Result<StreamHeader> header = CheckStreamHeader(recorded);
  if (!header.ok()) {
    changed_records_.push_back(NotAsSent(*session_, event, recorded, header.error()));
    ++channels_[channel].differing;
    return {};
  }
  Bytes numbered(replayed.begin(), replayed.end());
  RETURN_IF_ERROR(StampStreamHeader(numbered, *header));
  if (numbered == recorded) {
    ++channels_[channel].equal;
    return {};
  }
  ++channels_[channel].differing;
  if (!first_difference_.has_value()) {
    first_difference_ = {channel, session_->Where(event), std::move(recorded), std::move(numbered)};
  }
  return {};
}

Status ResultComparison::Finish() {
  for (const auto& [moment, events] : recorded_) {
    const auto came = replayed_.find(moment);
    for (std::size_t i = came == replayed_.end() ? 0 : came->second; i < events.size(); ++i) {
      ++channels_[moment.first].missing;
      ASSIGN_OR_RETURN(const Bytes recorded, session_->Read(events[i]));
      if (const auto header = CheckStreamHeader(recorded); !header.ok()) {
        changed_records_.push_back(NotAsSent(*session_, events[i], recorded, header.error()));
      }
    }
  }
  return {};
}

std::size_t ResultComparison::RecordedCount(const std::string& channel, std::int64_t utime) const {
  const auto recorded = recorded_.find({channel, utime});
  return recorded == recorded_.end() ? 0 : recorded->second.size();
}

ChannelComparison ResultComparison::Total() const {
  ChannelComparison total;
  for (const auto& [channel, counts] : channels_) {
    total.equal += counts.equal;
    total.differing += counts.differing;
    total.missing += counts.missing;
    total.extra += counts.extra;
  }
  return total;
}

bool ResultComparison::Same() const {
  const ChannelComparison total = Total();
  return total.Same() && total.equal > 0;
}

}  // namespace forgescan
