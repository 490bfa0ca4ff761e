// The sending half of the resend protocol: numbers messages, keeps the newest, and sends pieces of them again
// on request.
#pragma once

#include <deque>
#include <map>
#include <memory>
#include <set>
#include <string>
#include <tuple>

#include "fsmsg/resend_request_t.hpp"
#include "services/common/bus/bus.h"
#include "services/common/bus/stream_options.h"

namespace forgescan {

class StreamSender {
 public:
  StreamSender(Bus& bus, std::string sender, const StreamOptions& options, StreamCounters& counters);

  StreamSender(const StreamSender&) = delete;
  StreamSender& operator=(const StreamSender&) = delete;
  // Says a last time what was sent, so that a receiver notices a loss at the end.
  ~StreamSender();

  std::int64_t session() const { return session_; }
  // Announces the channel before its first message, so that receivers know its beginning.
  void Advertise(const std::string& channel) { histories_[channel]; }
  // Stamps and sends; a message the network refused is kept and can be asked for.
  // Errors: kInvalidArgument (too large or too short).
  Status Publish(const std::string& channel, Bytes message);
  void OnRequest(const fsmsg::resend_request_t& request);

 private:
  struct Kept {
    std::int64_t sent_us;
    std::shared_ptr<const Bytes> bytes;
  };
  struct History {
    std::int64_t first = 1;  // sequence of messages.front()
    std::int64_t bytes = 0;
    std::deque<Kept> messages;
  };
  using Piece = std::tuple<std::string, std::int64_t, std::int32_t>;  // channel, sequence, piece

  void Keep(History& history, std::shared_ptr<const Bytes> message);
  void SendStatus();
  void ScheduleStatus(std::int64_t delay_us);
  void SendNextPiece();
  void SendPiece(const Piece& piece);
  const Bytes* Find(const std::string& channel, std::int64_t sequence) const;

  Bus& bus_;
  std::string sender_;
  StreamOptions options_;
  StreamCounters& counters_;
  std::int64_t session_;
  std::map<std::string, History> histories_;
  std::deque<Piece> queue_;
  std::set<Piece> queued_;
  Bus::TimerId status_timer_ = 0;
  Bus::TimerId piece_timer_ = 0;
  std::int64_t status_delay_us_;
};

}  // namespace forgescan
