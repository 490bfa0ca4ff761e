#include "services/common/bus/stream_sender.h"

#include <algorithm>

#include "fsmsg/resend_piece_t.hpp"
#include "fsmsg/stream_status_t.hpp"
#include "services/common/bus/codec.h"
#include "services/common/bus/protocol_channels.h"
#include "services/common/bus/stream_header.h"

namespace forgescan {

StreamSender::StreamSender(Bus& bus, std::string sender, const StreamOptions& options,
                           StreamCounters& counters)
    : bus_(bus),
      sender_(std::move(sender)),
      options_(options),
      counters_(counters),
      session_(bus.NowUs()),
      status_delay_us_(options.status_first_us) {
  ScheduleStatus(0);
}

StreamSender::~StreamSender() {
  bus_.Cancel(status_timer_);
  bus_.Cancel(piece_timer_);
  if (!histories_.empty()) {
    SendStatus();
  }
}

Status StreamSender::Publish(const std::string& channel, Bytes message) {
  RETURN_IF_ERROR(CheckPublish(channel, message));
  History& history = histories_[channel];
  const std::int64_t sequence = history.first + static_cast<std::int64_t>(history.messages.size());
  RETURN_IF_ERROR(StampStreamHeader(message, {session_, sequence}));
  const auto kept = std::make_shared<const Bytes>(std::move(message));
  Keep(history, kept);
  ++counters_.published;
  // A refused send is a lost message like any other: the receivers ask for it.
  [[maybe_unused]] const Status sent = bus_.Publish(channel, *kept);
  ScheduleStatus(options_.status_first_us);
  return {};
}

// A message is not dropped while a receiver may still ask for it, but for the bound on memory.
void StreamSender::Keep(History& history, std::shared_ptr<const Bytes> message) {
  const std::int64_t now_us = bus_.NowUs();
  history.bytes += static_cast<std::int64_t>(message->size());
  history.messages.push_back({now_us, std::move(message)});
  const auto over = [&] {
    return history.bytes > options_.burst_bytes ||
           (history.bytes > options_.history_bytes &&
            now_us - history.messages.front().sent_us > options_.give_up_us);
  };
  while (history.messages.size() > 1 && over()) {
    history.bytes -= static_cast<std::int64_t>(history.messages.front().bytes->size());
    history.messages.pop_front();
    ++history.first;
  }
}

void StreamSender::ScheduleStatus(std::int64_t delay_us) {
  bus_.Cancel(status_timer_);
  status_delay_us_ = std::max(delay_us, options_.status_first_us);
  status_timer_ = bus_.At(bus_.NowUs() + delay_us, [this] {
    SendStatus();
    ScheduleStatus(std::min(2 * status_delay_us_, options_.status_period_us));
  });
}

void StreamSender::SendStatus() {
  fsmsg::stream_status_t status{};
  status.utime = bus_.NowUs();
  status.session = session_;
  status.sender = sender_;
  for (const auto& [channel, history] : histories_) {
    fsmsg::stream_t stream{};
    stream.channel = channel;
    stream.first_sequence = history.first;
    stream.last_sequence = history.first + static_cast<std::int64_t>(history.messages.size()) - 1;
    status.streams.push_back(stream);
  }
  status.stream_count = static_cast<std::int32_t>(status.streams.size());
  // Sent again in at most status_period_us, so a refusal needs no answer here.
  [[maybe_unused]] const Status sent = bus_.Publish(kStreamStatusChannel, Encode(status));
}

const Bytes* StreamSender::Find(const std::string& channel, std::int64_t sequence) const {
  const auto found = histories_.find(channel);
  if (found == histories_.end()) {
    return nullptr;
  }
  const std::int64_t index = sequence - found->second.first;
  const auto& messages = found->second.messages;
  return index >= 0 && index < static_cast<std::int64_t>(messages.size())
             ? messages[static_cast<std::size_t>(index)].bytes.get()
             : nullptr;
}

void StreamSender::OnRequest(const fsmsg::resend_request_t& request) {
  const Bytes* message = request.session == session_ ? Find(request.channel, request.sequence) : nullptr;
  if (message == nullptr) {
    return;  // another sender's, or no longer kept: the next status says so
  }
  ++counters_.resent;
  const auto count =
      static_cast<std::int32_t>((message->size() + static_cast<std::size_t>(options_.piece_bytes) - 1) /
                                static_cast<std::size_t>(options_.piece_bytes));
  const bool idle = queue_.empty();
  const auto add = [&](std::int32_t piece) {
    Piece wanted{request.channel, request.sequence, piece};
    if (piece >= 0 && piece < count && queued_.insert(wanted).second) {
      queue_.push_back(std::move(wanted));
    }
  };
  for (std::int32_t piece = 0; request.pieces.empty() && piece < count; ++piece) {
    add(piece);
  }
  std::for_each(request.pieces.begin(), request.pieces.end(), add);
  if (idle && !queue_.empty()) {
    SendNextPiece();
  }
}

void StreamSender::SendNextPiece() {
  const Piece piece = queue_.front();
  queue_.pop_front();
  queued_.erase(piece);
  SendPiece(piece);
  if (!queue_.empty()) {
    piece_timer_ = bus_.At(bus_.NowUs() + options_.piece_gap_us, [this] { SendNextPiece(); });
  }
}

void StreamSender::SendPiece(const Piece& piece) {
  const auto& [channel, sequence, index] = piece;
  const Bytes* message = Find(channel, sequence);
  if (message == nullptr) {
    return;
  }
  const std::int64_t begin = std::int64_t{index} * options_.piece_bytes;
  const std::int64_t end = std::min(begin + options_.piece_bytes, static_cast<std::int64_t>(message->size()));
  fsmsg::resend_piece_t sent{};
  sent.utime = bus_.NowUs();
  sent.channel = channel;
  sent.session = session_;
  sent.sequence = sequence;
  sent.message_bytes = static_cast<std::int32_t>(message->size());
  sent.piece = index;
  sent.piece_bytes = options_.piece_bytes;
  sent.data.assign(message->begin() + begin, message->begin() + end);
  sent.size = static_cast<std::int32_t>(sent.data.size());
  // A piece the network refused is asked for again.
  [[maybe_unused]] const Status status = bus_.Publish(kResendPieceChannel, Encode(sent));
}

}  // namespace forgescan
