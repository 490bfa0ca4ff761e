// Whether a thermometer can be believed: range, step, frozen, stale.
#pragma once

#include <cstdint>
#include <string>

#include "services/cooling/cooling_config.h"

namespace forgescan {

class SensorCheck {
 public:
  // Takes a reading of the sensor and the duty applied at that time. NaN: the sensor did not answer.
  // Returns why the reading cannot be believed; empty when it can. After a step the sensor is distrusted
  // until 1 s of readings without another one.
  std::string Judge(double degc, double duty, std::int64_t utime, const CoolingConfig& config);

 private:
  bool Stepped(double degc, std::int64_t utime, const CoolingConfig& config);
  bool Frozen(double degc, double duty, std::int64_t utime, const CoolingConfig& config);

  bool has_last_ = false;
  double last_degc_ = 0;
  std::int64_t last_utime_ = 0;
  std::int64_t distrusted_until_us_ = 0;
  // Extremes since the temperature last left its band of frozen_k.
  double low_degc_ = 0, high_degc_ = 0;
  double low_duty_ = 0, high_duty_ = 0;
  std::int64_t band_since_us_ = 0;
};

}  // namespace forgescan
