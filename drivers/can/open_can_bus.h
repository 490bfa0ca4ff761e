// Opens the CAN bus that a station file names by URL.
#pragma once

#include <memory>
#include <string_view>

#include "drivers/can/can_bus.h"

namespace forgescan {

// `socketcan:can0`, `udp:239.74.163.2:43113` or `udp:239.74.163.2:43113?hops=1` (0 hops, this host only, when
// not given). Errors: kInvalidArgument when the URL has another form; otherwise as OpenSocketCan and
// OpenUdpCan.
Result<std::unique_ptr<CanBus>> OpenCanBus(std::string_view url, TimeSource now_us);

}  // namespace forgescan
