// What all devices behind a wire have in common: orders in, events out, on the caller's thread and in the
// caller's time.
#pragma once

#include <cstdint>
#include <functional>

#include "services/common/result.h"

namespace forgescan {

// The device answers and is operational (up), or has fallen silent or restarted (not up). First event of
// every device.
struct DeviceLink {
  bool up = false;
  bool operator==(const DeviceLink&) const = default;
};

// The device reports a fault of its own. Codes as CANopen's EMCY; 0 = all faults have gone.
struct DeviceFault {
  std::uint16_t code = 0;
  std::uint32_t detail = 0;
  bool operator==(const DeviceFault&) const = default;
};

// Event is a std::variant that contains DeviceLink and DeviceFault.
template <typename CommandType, typename EventType>
class Device {
 public:
  using Command = CommandType;
  using Event = EventType;
  using Handler = std::function<void(const Event&)>;

  Device() = default;
  Device(const Device&) = delete;
  Device& operator=(const Device&) = delete;
  virtual ~Device() = default;

  // Hands over one order; whether it is carried out comes as events.
  // Errors: kInvalidArgument (out of range), kUnavailable or kIo (the wire refused).
  virtual Status Send(const Command& command) = 0;

  // Lets time-driven work happen: timeouts, cyclic frames, the simulation. Call every few milliseconds; time
  // never goes back.
  virtual void Step(std::int64_t now_us) = 0;

  // Handlers run inside Step or inside the bus's Drain.
  void SetHandler(Handler handler) { handler_ = std::move(handler); }

 protected:
  void Emit(const Event& event) {
    if (handler_) {
      handler_(event);
    }
  }

 private:
  Handler handler_;
};

}  // namespace forgescan
