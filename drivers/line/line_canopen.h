// The line's signals on the CAN bus: both directions of their wire format (station.dbc, node 40h).
#pragma once

#include <memory>
#include <vector>

#include "drivers/canopen/canopen_host.h"
#include "drivers/line/line.h"

namespace forgescan {

class LineProtocol {
 public:
  using Command = LineCommand;
  using Event = LineEvent;
  static constexpr std::uint8_t kNode = 0x40;
  static constexpr std::array<canopen::ObjectAddress, 0> kObjects{};

  Result<std::vector<CanFrame>> FramesOf(const LineCommand& command);
  Result<std::optional<LineEvent>> EventOf(const CanFrame& frame);
  std::optional<LineEvent> EventOfObjects(const std::map<canopen::ObjectAddress, std::uint32_t>&) {
    return std::nullopt;
  }

  Result<std::optional<LineCommand>> CommandOf(const CanFrame& frame);
  Result<std::vector<CanFrame>> FramesOf(const LineEvent& event);
  std::map<canopen::ObjectAddress, canopen::ObjectEntry> ObjectsOf(const LineEvent&) { return {}; }
};

std::unique_ptr<LineSignals> MakeCanLine(CanBus& bus);

}  // namespace forgescan
