// The receiving half of the resend protocol for one channel: delivers every message once, whole and in order,
// asks for what is missing, and after a bounded time gives up and says so.
//
//          first contact             gap seen                 pieces or message come
//   idle ----------------> in order ----------> waiting ------------------------------> in order
//                                                 | asked for without progress for give_up_us, the sender
//                                                 silent as | long, or the sender no longer has it
//                                                 +-----------> lost handler, then in order behind the hole
#pragma once

#include <deque>
#include <functional>
#include <map>
#include <string>
#include <vector>

#include "fsmsg/resend_piece_t.hpp"
#include "services/common/bus/bus.h"
#include "services/common/bus/stream_options.h"

namespace forgescan {

// Where a receiver stands with its sender. Times are those of this process; 0 = never.
struct StreamStanding {
  std::int64_t session = 0;         // of the sender; 0 = no contact yet
  std::int64_t joined_session = 0;  // the first one heard
  std::int64_t joined_at = 0;  // its first message that can be delivered; what it sent before was not heard
  std::int64_t heard_us = 0;   // last sign of life of the sender
  std::int64_t told_us = 0;    // last time it said what it had sent
  std::int64_t next = 1;       // sequence to be delivered next
  std::int64_t announced = 0;  // last sequence known to have been sent and not delivered; 0 = none
  bool waiting() const { return announced != 0; }
};

class StreamReceiver {
 public:
  using Handler = std::function<void(ByteView)>;
  using LostHandler = std::function<void(std::int64_t first_sequence, std::int64_t last_sequence)>;

  StreamReceiver(Bus& bus, std::string channel, const StreamOptions& options, StreamCounters& counters);

  void SetHandler(Handler handler) { handler_ = std::move(handler); }
  void SetLostHandler(LostHandler handler) { lost_handler_ = std::move(handler); }

  void OnMessage(ByteView bytes);
  void OnPiece(const fsmsg::resend_piece_t& piece);
  // What the channel's sender says of itself; `first` is the oldest sequence it can still send.
  void OnStatus(std::int64_t session, std::int64_t first, std::int64_t last);
  // Asks for what is missing, gives up what is overdue. To be called every few ms.
  void OnTimer();
  bool waiting() const { return !waiting_.empty(); }
  // In the lost handler `session` is that of the hole.
  StreamStanding standing() const {
    const std::int64_t announced = waiting_.empty() ? 0 : waiting_.rbegin()->first;
    return {session_, joined_session_, joined_at_, heard_us_, told_us_, next_, announced};
  }

 private:
  // A message from `next_` on that has not been delivered.
  struct Waiting {
    Bytes bytes;  // whole message, or room for its pieces
    bool complete = false;
    bool resent = false;       // pieces of it have come
    std::vector<bool> pieces;  // which have come; empty = none
    std::size_t pieces_open = 0;
    std::int64_t since_us = 0;        // noticed missing, or last progress
    std::int64_t first_asked_us = 0;  // 0 = not yet: its turn comes when older ones have arrived
    std::int64_t asked_us = 0;        // the last time
  };

  // Follows the sender into a new session, whichever is the higher. False: the bytes belong to one that was
  // left.
  bool EnterSession(std::int64_t session, std::int64_t first_sequence_if_joining);
  void NoteUpTo(std::int64_t last);
  void Complete(Waiting& waiting, ByteView bytes);
  void DeliverReady();
  void GiveUp(std::int64_t before);
  bool IsOverdue(const Waiting& waiting) const;
  void AskIfDue(std::int64_t sequence, Waiting& waiting);

  Bus& bus_;
  std::string channel_;
  StreamOptions options_;
  StreamCounters& counters_;
  Handler handler_;
  LostHandler lost_handler_;
  std::int64_t subscribed_us_;
  std::int64_t session_ = 0;       // 0 = no contact yet
  std::deque<std::int64_t> left_;  // the last sessions before it, oldest first; never entered again
  std::int64_t next_ = 1;          // sequence to be delivered next
  std::int64_t heard_us_ = 0;      // last sign of life of the sender
  std::int64_t told_us_ = 0;       // last status of the sender
  std::int64_t joined_session_ = 0;
  std::int64_t joined_at_ = 0;
  std::map<std::int64_t, Waiting> waiting_;
};

}  // namespace forgescan
