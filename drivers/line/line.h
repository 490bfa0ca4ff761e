// The signals of the production line: part in place, its temperature, and the gate that sorts it.
#pragma once

#include <variant>

#include "drivers/device.h"

namespace forgescan {

enum class LineVerdict : std::uint8_t { kUnknown, kOk, kNotOk, kNotDecidable, kNotInspected };
enum class GateState : std::uint8_t { kUnknown, kMoving, kDone, kStuck };

// Repeated with the same seq until the echo carries it and the gate is done or stuck.
struct LineCommand {
  std::uint32_t part = 0;
  LineVerdict verdict = LineVerdict::kUnknown;
  std::uint16_t seq = 0;
  bool operator==(const LineCommand&) const = default;
};

struct LinePart {
  std::int64_t utime = 0;  // us, of the delivery
  std::uint32_t part = 0;  // counted by the line; 0 = none yet
  bool in_place = false;
  bool clamped = false;
  bool running = false;
  std::uint32_t in_place_ms = 0;  // since it came to rest
  bool operator==(const LinePart&) const = default;
};

struct LinePyrometer {
  std::int64_t utime = 0;  // us
  std::uint32_t part = 0;
  double part_degc = 0;
  bool valid = false;  // it sees a part within its range
  bool operator==(const LinePyrometer&) const = default;
};

struct LineSortEcho {
  std::int64_t utime = 0;  // us
  std::uint32_t part = 0;
  LineVerdict verdict = LineVerdict::kUnknown;
  GateState gate = GateState::kUnknown;
  std::uint16_t seq_echo = 0;
  bool operator==(const LineSortEcho&) const = default;
};

using LineEvent = std::variant<DeviceLink, DeviceFault, LinePart, LinePyrometer, LineSortEcho>;
using LineSignals = Device<LineCommand, LineEvent>;

}  // namespace forgescan
