// CAN through the kernel's SocketCAN. Thin on purpose: it can only be tried where the kernel has AF_CAN.
#pragma once

#include <memory>
#include <string>

#include "drivers/can/can_bus.h"

namespace forgescan {

struct SocketCanConfig {
  std::string interface = "can0";
  int send_wait_ms = 5;          // how long Send waits when the transmit queue is full (ENOBUFS, EAGAIN)
  int max_bus_offs = 3;          // so many bus-offs ...
  double bus_off_window_s = 10;  // ... within this time, and Send refuses until the bus is opened again
};

// The interface must be up, with its bit rate and restart-ms set by the system (ip link set can0 type can
// bitrate ... restart-ms 100). Receive times are the kernel's. Bus-off and error states arrive as error
// frames and in counters(). Errors: kUnavailable when the kernel has no AF_CAN, the interface does not exist
// or is down.
Result<std::unique_ptr<CanBus>> OpenSocketCan(const SocketCanConfig& config, TimeSource now_us);

}  // namespace forgescan
