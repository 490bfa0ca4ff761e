// The bus as every service sees it: raw messages by channel, the time, and timers. One contract suite holds
// the implementations equal: LcmBus (processes, UDP multicast) and SimBus (one process, simulated time,
// seeded faults).
//
// Threads: everything is called, and every handler runs, on the one thread that runs the bus. Handlers must
// not throw.
#pragma once

#include <cstdint>
#include <functional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "services/common/clock/clock.h"
#include "services/common/result.h"

namespace forgescan {

using Bytes = std::vector<std::uint8_t>;
using ByteView = std::span<const std::uint8_t>;

// A message larger than this is refused: one 8-bit frame of 2448 x 2048 fits, anything larger travels in
// slices, because LCM reassembles in a fixed store of 16 MB and evicts in silence.
inline constexpr std::size_t kMaxMessageBytes = 5'500'000;

struct BusHealth {
  int receive_buffer_bytes = 0;   // of the socket, as read back; 0 = the bus has none
  std::int64_t socket_drops = 0;  // datagrams dropped by the kernel since start
};

class Bus : public Clock {
 public:
  using MessageHandler = std::function<void(ByteView)>;
  using TimerHandler = std::function<void()>;
  using TimerId = std::uint64_t;
  using SubscriptionId = std::uint64_t;

  // Sends to every subscriber of the channel in every process, this one included.
  // Errors: kInvalidArgument (too large, channel name empty or over 63 characters), kIo (the network
  // refused).
  virtual Status Publish(std::string_view channel, ByteView message) = 0;
  // Delivery is unreliable and unordered, as the network's; see StreamHub for streams that are complete and
  // in order.
  virtual SubscriptionId Subscribe(const std::string& channel, MessageHandler handler) = 0;
  // The handler does not run any more; what it refers to may go. Not to be called inside a message handler.
  virtual void Unsubscribe(SubscriptionId subscription) = 0;

  // Runs the handler once, not before `utime`. Timers due at the same time run in the order they were set.
  virtual TimerId At(std::int64_t utime, TimerHandler handler) = 0;
  // Runs the handler every `period_us`, first after one period; periods that were missed are skipped, not
  // made up for.
  virtual TimerId Every(std::int64_t period_us, TimerHandler handler) = 0;
  virtual void Cancel(TimerId timer) = 0;

  virtual BusHealth Health() const = 0;
};

// Shared by the implementations: the sentence for a message that must not be sent, or ok.
Status CheckPublish(std::string_view channel, ByteView message);

}  // namespace forgescan
