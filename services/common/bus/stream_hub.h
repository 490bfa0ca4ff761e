// Reliable, ordered streams of typed messages over a Bus that may lose, duplicate and reorder: sequence
// numbers, CRC-32, resend on request, bounded give-up. One StreamHub a service; one sender a channel.
//
// Why: LCM loses large messages in silence when a kernel buffer is too small or a process is away too long.
// With net.core.rmem_max at 128 MB (sysctl) resends are rare; with Debian's defaults they carry everything.
#pragma once

#include <map>
#include <memory>
#include <string>
#include <vector>

#include "services/common/bus/channel.h"
#include "services/common/bus/codec.h"
#include "services/common/bus/stream_receiver.h"
#include "services/common/bus/stream_sender.h"

namespace forgescan {

class StreamHub {
 public:
  StreamHub(Bus& bus, const std::string& sender, const StreamOptions& options = {});
  StreamHub(const StreamHub&) = delete;
  StreamHub& operator=(const StreamHub&) = delete;
  ~StreamHub();

  Bus& bus() { return bus_; }
  std::int64_t session() const { return sender_.session(); }
  const StreamCounters& counters() const { return counters_; }

  // Says at once that this service sends on the channel; so a receiver misses nothing from its first message
  // on.
  template <typename Message>
  void Advertise(const Channel<Message>& channel) {
    sender_.Advertise(channel.name);
  }
  // session, sequence and crc32 of the message are stamped here. Errors: kInvalidArgument (too large).
  template <typename Message>
  Status Publish(const Channel<Message>& channel, const Message& message) {
    return sender_.Publish(channel.name, Encode(message));
  }
  // The same for a message whose type only its receivers know (play). Errors: kInvalidArgument (too large, or
  // too short for a stream's header).
  void AdvertiseChannel(const std::string& channel) { sender_.Advertise(channel); }
  Status PublishBytes(const std::string& channel, Bytes message) {
    return sender_.Publish(channel, std::move(message));
  }
  // Every message once, in order. What does not decode is counted, never delivered.
  template <typename Message>
  void Subscribe(const Channel<Message>& channel, std::function<void(const Message&)> handler) {
    Receiver(channel.name).SetHandler([this, handler = std::move(handler)](ByteView bytes) {
      const Result<Message> message = Decode<Message>(bytes);
      message.ok() ? handler(*message) : static_cast<void>(++counters_.damaged);
    });
  }
  // Called in the place of messages that were given up, with the first and last sequence number of the hole.
  template <typename Message>
  void OnLost(const Channel<Message>& channel, StreamReceiver::LostHandler handler) {
    Receiver(channel.name).SetLostHandler(std::move(handler));
  }
  // Every message once, in order and whole, but not decoded: for whoever keeps messages as they are, of any
  // channel.
  void SubscribeRaw(const std::string& channel, StreamReceiver::Handler handler) {
    Receiver(channel).SetHandler(std::move(handler));
  }
  void OnLost(const std::string& channel, StreamReceiver::LostHandler handler) {
    Receiver(channel).SetLostHandler(std::move(handler));
  }
  // Of a channel never subscribed: all zero.
  StreamStanding Standing(const std::string& channel) const {
    const auto found = receivers_.find(channel);
    return found != receivers_.end() ? found->second->standing() : StreamStanding{};
  }
  // A message that the sender has announced is still to come, or to be given up. False for a channel never
  // subscribed.
  template <typename Message>
  bool Waiting(const Channel<Message>& channel) const {
    const auto found = receivers_.find(channel.name);
    return found != receivers_.end() && found->second->waiting();
  }

 private:
  StreamReceiver& Receiver(const std::string& channel);
  void Hear(const std::string& channel, Bus::MessageHandler handler);

  Bus& bus_;
  StreamOptions options_;
  StreamCounters counters_;
  StreamSender sender_;
  std::map<std::string, std::unique_ptr<StreamReceiver>> receivers_;
  Bus::TimerId timer_;
  std::vector<Bus::SubscriptionId> subscriptions_;
};

// Periodic state, where only the newest message counts: no sequence, no resend.
template <typename Message>
Status PublishState(Bus& bus, const StateChannel<Message>& channel, const Message& message) {
  return bus.Publish(channel.name, Encode(message));
}
// What does not decode is left out: the sender says it again within a second.
template <typename Message>
Bus::SubscriptionId SubscribeState(Bus& bus, const StateChannel<Message>& channel,
                                   std::function<void(const Message&)> handler) {
  return bus.Subscribe(channel.name, [handler = std::move(handler)](ByteView bytes) {
    if (const Result<Message> message = Decode<Message>(bytes); message.ok()) {
      handler(*message);
    }
  });
}

}  // namespace forgescan
