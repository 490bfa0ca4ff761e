// The robot that carries the scanner along a taught path, as its controller presents it.
#pragma once

#include <variant>

#include "drivers/device.h"

namespace forgescan {

enum class RobotOrder : std::uint8_t { kNop, kSelectPath, kGoView, kPause, kHome, kAbort, kResetFault };
enum class RobotState : std::uint8_t {
  kBoot,
  kIdle,
  kMoving,
  kSettling,
  kInPosition,
  kPaused,
  kFault,
  kHome
};

// A new seq is a new order; the same seq again is the same order, which a controller that has it carries out
// only once.
struct RobotCommand {
  std::uint16_t seq = 0;
  RobotOrder order = RobotOrder::kNop;
  std::uint16_t path = 0;
  std::uint16_t view = 0;
  bool operator==(const RobotCommand&) const = default;
};

struct RobotStatus {
  std::int64_t utime = 0;  // us, of the delivery
  std::uint16_t seq_echo = 0;
  RobotState state = RobotState::kBoot;
  bool in_position = false;
  bool automatic = false;
  bool drives_on = false;
  bool warm = false;  // the body is at the temperature of the taught view matrices
  bool protective_stop = false;
  bool path_valid = false;
  std::uint16_t path = 0;
  std::uint16_t view = 0;
  bool operator==(const RobotStatus&) const = default;
};

struct RobotMotion {
  std::int64_t utime = 0;  // us
  std::uint32_t in_position_ms = 0;
  double body_degc = 0;
  double override_pct = 100;
  bool operator==(const RobotMotion&) const = default;
};

// What the controller knows of its path; follows every DeviceLink{up}. The CRC binds the view matrices to the
// path.
struct RobotPath {
  std::uint16_t view_count = 0;
  std::uint32_t crc32 = 0;
  std::uint16_t settle_ms = 0;
  std::uint16_t move_timeout_ms = 0;
  bool operator==(const RobotPath&) const = default;
};

// DeviceFault code FF01h: a view out of the order of the path was refused; detail = seq | view << 16.
using RobotEvent = std::variant<DeviceLink, DeviceFault, RobotStatus, RobotMotion, RobotPath>;
using Robot = Device<RobotCommand, RobotEvent>;

}  // namespace forgescan
