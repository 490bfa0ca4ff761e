// The cooling unit on the CAN bus: both directions of its wire format (station.dbc, node 20h).
#pragma once

#include <memory>
#include <vector>

#include "drivers/canopen/canopen_host.h"
#include "drivers/cooling/cooling.h"

namespace forgescan {

class CoolingProtocol {
 public:
  using Command = CoolingCommand;
  using Event = CoolingEvent;
  static constexpr std::uint8_t kNode = 0x20;
  static constexpr std::array<canopen::ObjectAddress, 0> kObjects{};

  Result<std::vector<CanFrame>> FramesOf(const CoolingCommand& command);
  Result<std::optional<CoolingEvent>> EventOf(const CanFrame& frame);
  std::optional<CoolingEvent> EventOfObjects(const std::map<canopen::ObjectAddress, std::uint32_t>&) {
    return std::nullopt;
  }

  Result<std::optional<CoolingCommand>> CommandOf(const CanFrame& frame);
  Result<std::vector<CanFrame>> FramesOf(const CoolingEvent& event);
  std::map<canopen::ObjectAddress, canopen::ObjectEntry> ObjectsOf(const CoolingEvent&) { return {}; }

 private:
  std::uint8_t counter_ = 0;  // of commands sent, modulo 256
};

std::unique_ptr<CoolingUnit> MakeCanCooling(CanBus& bus);

}  // namespace forgescan
