// A CAN bus as this system sees it: frames in, frames out, on the caller's thread.
//
// Three backends keep one contract (tests/drivers/can/can_bus_contract_test.cc): SocketCAN for real hardware,
// UDP multicast for hosts whose kernel has no AF_CAN, and an in-process bus in simulated time that can fail
// like the real one.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "services/common/result.h"

namespace forgescan {

inline constexpr std::uint32_t kMaxStandardCanId = 0x7FF;
inline constexpr std::uint32_t kMaxExtendedCanId = 0x1FFFFFFF;

// One classic CAN frame. Bytes of data at and beyond `length` are zero.
struct CanFrame {
  std::uint32_t id = 0;  // 11 bits, or 29 when extended
  bool extended = false;
  bool rtr = false;         // remote transmission request: carries a length, no data
  bool error = false;       // reported by the controller, never sent
  std::uint8_t length = 0;  // 0..8
  std::array<std::uint8_t, 8> data{};
  std::int64_t utime = 0;  // microseconds at which the bus delivered the frame; ignored by Send

  bool operator==(const CanFrame&) const = default;
};

// The same frame on the wire, whenever it was delivered.
bool SameOnWire(const CanFrame& a, const CanFrame& b);

// Errors: kInvalidArgument when the identifier or the length is out of range, or an error frame is to be
// sent.
Status CheckSendable(const CanFrame& frame);

// Lets a frame pass when (frame.id & mask) == (id & mask) and the kind of identifier agrees.
struct CanFilter {
  std::uint32_t id = 0;
  std::uint32_t mask = kMaxStandardCanId;
  bool extended = false;

  bool Passes(const CanFrame& frame) const;
};

struct CanCounters {
  std::uint64_t sent = 0;
  std::uint64_t received = 0;       // delivered to the handlers
  std::uint64_t send_failures = 0;  // refused by the controller, the kernel or the argument check
  std::uint64_t filtered = 0;       // well formed, but no filter lets them pass
  std::uint64_t malformed = 0;      // bytes on the wire that are not a frame
  std::uint64_t error_frames = 0;
  std::uint64_t bus_offs = 0;
};

// Where a backend takes the time of a delivered frame from (microseconds).
using TimeSource = std::function<std::int64_t()>;

class CanBus {
 public:
  using Handler = std::function<void(const CanFrame&)>;

  CanBus() = default;
  CanBus(const CanBus&) = delete;
  CanBus& operator=(const CanBus&) = delete;
  virtual ~CanBus() = default;

  // Hands one frame to the controller. It does not come back to this bus object.
  // Errors: kInvalidArgument (not a sendable frame), kUnavailable (bus-off, interface down, queue full), kIo.
  virtual Status Send(const CanFrame& frame) = 0;

  // Delivers the waiting frames to the handlers on the caller's thread and returns without waiting for more.
  // Errors: kUnavailable (the interface went away), kIo.
  virtual Status Drain() = 0;

  // What to poll() for reading; -1 when the bus has no descriptor.
  virtual int fd() const = 0;

  // An empty list lets every frame pass (as a fresh bus does). Error frames always pass.
  virtual Status SetFilters(std::vector<CanFilter> filters);

  // Adds a handler; every handler sees every frame, in the order of registration. A handler lives as long as
  // the bus is drained. A handler may call Send, not Drain.
  void AddHandler(Handler handler) { handlers_.push_back(std::move(handler)); }

  const CanCounters& counters() const { return counters_; }

 protected:
  // Counts, filters and hands a received frame to the handlers.
  void Deliver(const CanFrame& frame);

  CanCounters counters_;

 private:
  std::vector<CanFilter> filters_;
  std::vector<Handler> handlers_;
};

}  // namespace forgescan
