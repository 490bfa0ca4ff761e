// Holds what services send in a replay against what was recorded, byte for byte. Only the stream's numbering
// is taken over from the record: session and sequence say how long the sender had been running, and a part's
// recording does not begin with the first message. The checksum over all bytes is computed anew with them, so
// the comparison is of whole messages.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <tuple>
#include <vector>

#include "tools/forgescan/replay/recorded_session.h"

namespace forgescan {

struct ChannelComparison {
  std::int64_t equal = 0;
  std::int64_t differing = 0;
  std::int64_t missing = 0;  // recorded, but not sent in the replay
  std::int64_t extra = 0;    // sent in the replay, but not recorded

  bool Same() const { return differing == 0 && missing == 0 && extra == 0; }
};

// The first message that is not as recorded.
struct FirstDifference {
  std::string channel;
  std::string where;  // of the recorded message
  Bytes recorded;
  Bytes replayed;
};

// "FILE, event 12 at byte 345: VERDICT part 2 is not as it was sent: the checksum does not match"
std::string NotAsSent(const RecordedSession& session, const RecordedEvent& event, ByteView message,
                      const Error& error);

class ResultComparison {
 public:
  // `session` outlives the comparison. Errors: kIo.
  static Result<ResultComparison> Create(const RecordedSession& session,
                                         const std::vector<std::string>& channels);

  // A message sent in the replay. Messages belong together by channel and utime, several with one utime in
  // their order. A recorded message that is not as it was sent is a difference. Errors: kIo (the record
  // cannot be read), kFormat (`replayed` is no stream's message).
  Status Add(const std::string& channel, ByteView replayed);
  // After the last message: what has not come is missing. Errors: kIo.
  Status Finish();

  // How many messages on the channel are recorded of the event that was then.
  std::size_t RecordedCount(const std::string& channel, std::int64_t utime) const;
  const std::map<std::string, ChannelComparison>& channels() const { return channels_; }
  // Recorded messages that are not as they were sent, one sentence each.
  const std::vector<std::string>& changed_records() const { return changed_records_; }
  const std::optional<FirstDifference>& first_difference() const { return first_difference_; }
  // No difference, and something was compared.
  bool Same() const;
  // Sums over all channels.
  ChannelComparison Total() const;

 private:
  using Moment = std::pair<std::string, std::int64_t>;  // channel, utime of the message
  explicit ResultComparison(const RecordedSession& session) : session_(&session) {}
  Status Compare(const RecordedEvent& event, const std::string& channel, ByteView replayed);

  const RecordedSession* session_;
  std::map<Moment, std::vector<RecordedEvent>> recorded_;
  std::map<Moment, std::size_t> replayed_;  // how many have come
  std::map<std::string, ChannelComparison> channels_;
  std::vector<std::string> changed_records_;
  std::optional<FirstDifference> first_difference_;
};

}  // namespace forgescan
