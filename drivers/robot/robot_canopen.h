// The robot on the CAN bus: both directions of its wire format (station.dbc, node 10h).
#pragma once

#include <memory>
#include <vector>

#include "drivers/canopen/canopen_host.h"
#include "drivers/robot/robot.h"

namespace forgescan {

class RobotProtocol {
 public:
  using Command = RobotCommand;
  using Event = RobotEvent;
  static constexpr std::uint8_t kNode = 0x10;
  static constexpr std::array<canopen::ObjectAddress, 4> kObjects{
      {{0x2100, 0}, {0x2101, 0}, {0x2102, 0}, {0x2103, 0}}};

  Result<std::vector<CanFrame>> FramesOf(const RobotCommand& command);
  Result<std::optional<RobotEvent>> EventOf(const CanFrame& frame);
  std::optional<RobotEvent> EventOfObjects(const std::map<canopen::ObjectAddress, std::uint32_t>& objects);

  Result<std::optional<RobotCommand>> CommandOf(const CanFrame& frame);
  Result<std::vector<CanFrame>> FramesOf(const RobotEvent& event);
  std::map<canopen::ObjectAddress, canopen::ObjectEntry> ObjectsOf(const RobotEvent& event);
};

std::unique_ptr<Robot> MakeCanRobot(CanBus& bus);

}  // namespace forgescan
