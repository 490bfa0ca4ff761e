// Settings of the cooling service; the only home of their defaults.
#pragma once

#include "services/common/config/config.h"

namespace forgescan {

struct CoolingConfig {
  // Control. Gains by SIMC on the simulated plant (gain 13 K per duty, 170 s, delay 20 s).
  double setpoint_degc = 32;
  double kp_per_k = 0.3;
  double ki_per_k_s = 0.0025;
  double kff_per_k = 0.12;       // of ambient above the set-point
  double max_duty = 1;           // 0..1
  double max_slew_per_s = 0.05;  // of the duty
  double safe_duty = 0.3;        // without a usable thermometer

  // Thermometers.
  double min_valid_degc = -20;
  double max_valid_degc = 80;
  double max_step_k_per_s = 5;
  double min_difference_k = -2;  // outlet - inlet
  double max_difference_k = 15;
  double stale_s = 1;
  double frozen_k = 0.05;    // moves less than this ...
  double frozen_s = 600;     // ... in this time ...
  double frozen_duty = 0.2;  // ... while the duty moved by more than this
  double blind_stop_s = 60;  // no thermometer for so long stops the inspection

  // Interlocks.
  double warn_degc = 36;
  double stop_degc = 40;
  double power_off_degc = 45;
  double hot_side_off_degc = 70;
  double hysteresis_k = 2;
  double min_flow_lpm = 100;
  double flow_grace_s = 1;           // pump or flow lost for so long: cooler off
  double dew_margin_k = 3;           // the coldest surface stays above the dew point by this
  double dew_off_margin_k = 1;       // below this: cooler off
  double assumed_humidity_pct = 80;  // without a humidity sensor
  double max_cooling_k = 8;          // that the cooler takes off the air at full duty

  // Errors: kInvalidArgument, naming the field and its range.
  Status Check() const;
  // Reads the table [cooling]. Errors: as ConfigTable, and Check().
  static Result<CoolingConfig> Load(ConfigTable table);
};

}  // namespace forgescan
