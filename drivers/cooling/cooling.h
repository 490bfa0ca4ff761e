// The scanner's cooling unit: closed air loop with pump, thermoelectric cooler, thermometers at inlet and
// outlet (paper, 2.1.1).
#pragma once

#include <variant>

#include "drivers/device.h"

namespace forgescan {

enum class CoolingUnitState : std::uint8_t { kBoot, kStopped, kRunning, kSafe, kFault };

// The unit falls back to its safe duty when no command comes for 1 s.
struct CoolingCommand {
  double duty = 0;  // of the thermoelectric cooler, 0..1
  bool pump_on = false;
  bool projector_off = false;
  bool sensor_power_off = false;
};

// NaN: that thermometer does not answer.
struct CoolingTemperatures {
  std::int64_t utime = 0;  // us, of the delivery
  double inlet_degc = 0;   // air into the scanner
  double outlet_degc = 0;  // air out of it
  double ambient_degc = 0;
  double hot_side_degc = 0;  // of the thermoelectric cooler
};

struct CoolingStatus {
  std::int64_t utime = 0;  // us
  CoolingUnitState state = CoolingUnitState::kBoot;
  double duty = 0;  // applied, 0..1
  double flow_lpm = 0;
  bool pump_on = false;
  bool projector_off = false;
  bool sensor_power_off = false;
  double humidity_pct = 0;  // relative, of the ambient air; NaN: no sensor
};

using CoolingEvent = std::variant<DeviceLink, DeviceFault, CoolingTemperatures, CoolingStatus>;
using CoolingUnit = Device<CoolingCommand, CoolingEvent>;

}  // namespace forgescan
