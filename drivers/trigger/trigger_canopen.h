// The trigger microcontroller on the CAN bus: both directions of its wire format (station.dbc, node 30h).
#pragma once

#include <memory>
#include <vector>

#include "drivers/can/station_frames.h"
#include "drivers/canopen/canopen_host.h"
#include "drivers/trigger/trigger.h"

namespace forgescan {

// A command is two frames: the timing first, then the command of the same seq.
class TriggerProtocol {
 public:
  using Command = TriggerCommand;
  using Event = TriggerEvent;
  static constexpr std::uint8_t kNode = 0x30;
  static constexpr std::array<canopen::ObjectAddress, 0> kObjects{};

  Result<std::vector<CanFrame>> FramesOf(const TriggerCommand& command);
  Result<std::optional<TriggerEvent>> EventOf(const CanFrame& frame);
  std::optional<TriggerEvent> EventOfObjects(const std::map<canopen::ObjectAddress, std::uint32_t>&) {
    return std::nullopt;
  }

  // Errors: also kProtocol for a command whose timing did not come before it.
  Result<std::optional<TriggerCommand>> CommandOf(const CanFrame& frame);
  Result<std::vector<CanFrame>> FramesOf(const TriggerEvent& event);
  std::map<canopen::ObjectAddress, canopen::ObjectEntry> ObjectsOf(const TriggerEvent&) { return {}; }

 private:
  std::optional<station::TriggerTiming> timing_;
};

std::unique_ptr<Trigger> MakeCanTrigger(CanBus& bus);

}  // namespace forgescan
