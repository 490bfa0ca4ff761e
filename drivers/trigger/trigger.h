// The microcontroller that steps the projector and fires the two cameras by time-division multiplexing.
//
// A projector period shows one pattern and has two halves: the left camera exposes in the first while the
// right one transmits, and the other way round (paper, section 2.1.2).
#pragma once

#include <variant>

#include "drivers/device.h"

namespace forgescan {

enum class TriggerMode : std::uint8_t { kNone, kFire, kAbort };
enum class TriggerState : std::uint8_t { kBoot, kIdle, kFiring, kDone, kFault };

struct TriggerCommand {
  std::uint16_t seq = 0;
  TriggerMode mode = TriggerMode::kNone;
  std::uint16_t view = 0;          // 0..4095, a tag
  std::uint8_t pulses = 0;         // projector periods, 0..32: pulses of each camera
  std::uint32_t period_us = 0;     // of the projector, below 2^24
  std::uint16_t exposure_us = 10;  // 10..40950, in steps of 10
  std::uint8_t first_pattern = 0;  // first_pattern + pulses <= 32
  std::uint8_t cameras = 2;        // 1 (left only) or 2
  bool operator==(const TriggerCommand&) const = default;
};

struct TriggerStatus {
  std::int64_t utime = 0;  // us, of the delivery
  std::uint16_t seq_echo = 0;
  TriggerState state = TriggerState::kBoot;
  std::uint8_t pulses_done = 0;
  std::uint32_t device_time_us = 0;  // wraps after 71.6 min
  bool operator==(const TriggerStatus&) const = default;
};

// One exposure as it happened.
struct TriggerPulse {
  std::int64_t utime = 0;    // us, of the delivery, after the exposure
  std::uint8_t seq_low = 0;  // low 2 bits of the command's seq
  bool right = false;        // camera
  std::uint8_t pattern = 0;
  std::uint16_t pulse = 0;  // count of this camera since power-on, modulo 4096; 1 is the first
  std::uint16_t exposure_us = 0;
  std::uint32_t device_time_us = 0;  // start of the exposure, wraps
  bool operator==(const TriggerPulse&) const = default;
};

using TriggerEvent = std::variant<DeviceLink, DeviceFault, TriggerStatus, TriggerPulse>;
using Trigger = Device<TriggerCommand, TriggerEvent>;

}  // namespace forgescan
