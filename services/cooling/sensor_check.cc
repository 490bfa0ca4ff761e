#include "services/cooling/sensor_check.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>

namespace forgescan {
namespace {

constexpr std::int64_t kSettled_us = 1'000'000;
constexpr double kShortest_s = 0.05;  // bounds the noise of the derivative when frames bunch

}  // namespace

bool SensorCheck::Stepped(double degc, std::int64_t utime, const CoolingConfig& config) {
  const double seconds = std::max(1e-6 * static_cast<double>(utime - last_utime_), kShortest_s);
  if (std::abs(degc - last_degc_) > config.max_step_k_per_s * seconds) {
    distrusted_until_us_ = utime + kSettled_us;
  }
  return utime < distrusted_until_us_;
}

bool SensorCheck::Frozen(double degc, double duty, std::int64_t utime, const CoolingConfig& config) {
  low_degc_ = std::min(low_degc_, degc);
  high_degc_ = std::max(high_degc_, degc);
  low_duty_ = std::min(low_duty_, duty);
  high_duty_ = std::max(high_duty_, duty);
  if (high_degc_ - low_degc_ >= config.frozen_k) {
    low_degc_ = high_degc_ = degc;
    low_duty_ = high_duty_ = duty;
    band_since_us_ = utime;
  }
  const bool long_enough = 1e-6 * static_cast<double>(utime - band_since_us_) >= config.frozen_s;
  return long_enough && high_duty_ - low_duty_ > config.frozen_duty;
}

std::string SensorCheck::Judge(double degc, double duty, std::int64_t utime, const CoolingConfig& config) {
  if (std::isnan(degc)) {
    has_last_ = false;
    return "does not answer";
  }
  if (!(degc >= config.min_valid_degc && degc <= config.max_valid_degc)) {
    has_last_ = false;
    return fmt::format("reads {:.1f} degC, outside {}..{}", degc, config.min_valid_degc,
                       config.max_valid_degc);
  }
  if (!has_last_) {
    low_degc_ = high_degc_ = last_degc_ = degc;
    low_duty_ = high_duty_ = duty;
    band_since_us_ = last_utime_ = utime;
    has_last_ = true;
  }
  const bool stepped = Stepped(degc, utime, config);
  const bool frozen = Frozen(degc, duty, utime, config);
  last_degc_ = degc;
  last_utime_ = utime;
  if (stepped) {
    return fmt::format("jumped by more than {} K/s", config.max_step_k_per_s);
  }
  return frozen ? fmt::format("has not moved for {:.0f} s", config.frozen_s) : "";
}

}  // namespace forgescan
