#include "services/common/bus/stream_hub.h"

#include "fsmsg/stream_status_t.hpp"
#include "services/common/bus/protocol_channels.h"

namespace forgescan {
namespace {

constexpr std::int64_t kTimerPeriodUs = 10'000;

}  // namespace

StreamHub::StreamHub(Bus& bus, const std::string& sender, const StreamOptions& options)
    : bus_(bus), options_(options), sender_(bus, sender, options, counters_) {
  Hear(kStreamStatusChannel, [this](ByteView bytes) {
    const auto status = Decode<fsmsg::stream_status_t>(bytes);
    if (!status.ok()) {
      ++counters_.damaged;
      return;
    }
    for (const auto& stream : status->streams) {
      if (const auto found = receivers_.find(stream.channel); found != receivers_.end()) {
        found->second->OnStatus(status->session, stream.first_sequence, stream.last_sequence);
      }
    }
  });
  Hear(kResendRequestChannel, [this](ByteView bytes) {
    const auto request = Decode<fsmsg::resend_request_t>(bytes);
    request.ok() ? sender_.OnRequest(*request) : static_cast<void>(++counters_.damaged);
  });
  Hear(kResendPieceChannel, [this](ByteView bytes) {
    const auto piece = Decode<fsmsg::resend_piece_t>(bytes);
    const auto found = piece.ok() ? receivers_.find(piece->channel) : receivers_.end();
    if (found != receivers_.end()) {
      found->second->OnPiece(*piece);
    }
  });
  timer_ = bus_.Every(kTimerPeriodUs, [this] {
    for (const auto& [channel, receiver] : receivers_) {
      receiver->OnTimer();
    }
  });
}

StreamHub::~StreamHub() {
  bus_.Cancel(timer_);
  for (const Bus::SubscriptionId subscription : subscriptions_) {
    bus_.Unsubscribe(subscription);
  }
}

void StreamHub::Hear(const std::string& channel, Bus::MessageHandler handler) {
  subscriptions_.push_back(bus_.Subscribe(channel, std::move(handler)));
}

StreamReceiver& StreamHub::Receiver(const std::string& channel) {
  auto& receiver = receivers_[channel];
  if (receiver == nullptr) {
    receiver = std::make_unique<StreamReceiver>(bus_, channel, options_, counters_);
    Hear(channel, [to = receiver.get()](ByteView bytes) { to->OnMessage(bytes); });
  }
  return *receiver;
}

}  // namespace forgescan
