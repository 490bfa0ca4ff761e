// CAN frames as UDP multicast datagrams, for hosts whose kernel has no AF_CAN and for the virtual station.
//
// UDP has no arbitration, acknowledgement, error frames or bus-off, and a datagram may be lost without
// notice: what a CAN controller guarantees does not hold here. Anyone who can reach the group can send: keep
// the hop limit at 0.
#pragma once

#include <memory>
#include <string>

#include "drivers/can/can_bus.h"

namespace forgescan {

struct UdpCanConfig {
  std::string group = "239.74.163.2";  // IPv4 multicast address
  std::uint16_t port = 43113;
  int hop_limit = 0;  // 0: this host only; 1: this subnet, as python-can has it

  // Errors: kInvalidArgument when the group is no IPv4 multicast address, the port 0, or the hop limit
  // outside 0..32.
  Status Check() const;
};

// Errors: kInvalidArgument (configuration), kUnavailable (no socket, no route to the group).
Result<std::unique_ptr<CanBus>> OpenUdpCan(const UdpCanConfig& config, TimeSource now_us);

}  // namespace forgescan
