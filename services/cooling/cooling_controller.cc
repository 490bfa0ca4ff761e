#include "services/cooling/cooling_controller.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "services/cooling/dew_point.h"

namespace forgescan {
namespace {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
constexpr double kDifferenceMeanWeight = 0.01;  // of one reading: a mean over some 10 s at 10 Hz
constexpr double kLongestTick_s = 1;            // a stalled caller must not make the integral jump

double Seconds(std::int64_t us) { return 1e-6 * static_cast<double>(us); }

}  // namespace

void CoolingController::OnTemperatures(const CoolingInput& input) {
  input_ = input;
  JudgeSensors();
}

void CoolingController::OnUnit(const CoolingUnitReport& report) {
  unit_ = report;
  const bool flows = report.pump_on && report.flow_lpm >= config_.min_flow_lpm;
  if (flows) {
    no_flow_since_us_.reset();
  } else if (!no_flow_since_us_) {
    no_flow_since_us_ = report.utime;
  }
}

// The air that leaves the scanner is as warm as its inside. With only the inlet left, the last known
// difference is added.
void CoolingController::JudgeSensors() {
  const std::string inlet = inlet_check_.Judge(input_->inlet_degc, duty_, input_->utime, config_);
  const std::string outlet = outlet_check_.Judge(input_->outlet_degc, duty_, input_->utime, config_);
  const double difference_k = input_->outlet_degc - input_->inlet_degc;
  sensor_fault_.clear();
  if (!outlet.empty()) {
    sensor_fault_ = "outlet thermometer " + outlet;
  }
  if (!inlet.empty()) {
    sensor_fault_ += (sensor_fault_.empty() ? "inlet thermometer " : ", inlet thermometer ") + inlet;
  }
  if (outlet.empty() && inlet.empty()) {
    if (difference_k < config_.min_difference_k || difference_k > config_.max_difference_k) {
      sensor_fault_ = fmt::format("outlet is {:.1f} K above inlet, outside {}..{}", difference_k,
                                  config_.min_difference_k, config_.max_difference_k);
    } else {
      difference_k_ += kDifferenceMeanWeight * (difference_k - difference_k_);
    }
    // Of two that disagree the warmer one is believed: too much cooling is the smaller harm.
    inside_degc_ =
        sensor_fault_.empty() ? input_->outlet_degc : std::max(input_->outlet_degc, input_->inlet_degc);
  } else if (outlet.empty()) {
    inside_degc_ = input_->outlet_degc;
  } else {
    inside_degc_ = inlet.empty() ? input_->inlet_degc + difference_k_ : kNaN;
  }
}

double CoolingController::Slewed(double wanted, double dt_s) const {
  const double step = config_.max_slew_per_s * dt_s;
  return std::clamp(wanted, duty_ - step, duty_ + step);
}

// The integral follows what is really applied (limit and slew included), so that it cannot wind up.
double CoolingController::Regulate(double dt_s) {
  const double error_k = inside_degc_ - config_.setpoint_degc;
  const bool ambient_known = std::isfinite(input_->ambient_degc);
  const double feed_forward =
      ambient_known ? config_.kff_per_k * (input_->ambient_degc - config_.setpoint_degc) : 0;
  const double wanted = config_.kp_per_k * error_k + integral_ + feed_forward;
  const double target = manual_duty_ ? *manual_duty_ : wanted;
  const double applied = Slewed(std::clamp(target, 0.0, DutyLimit()), dt_s);
  const double tracking_s = config_.kp_per_k / config_.ki_per_k_s;
  integral_ += dt_s * (config_.ki_per_k_s * error_k + (applied - wanted) / tracking_s);
  return applied;
}

// The cooler takes at most max_cooling_k (2d - d^2) off the ambient air; the duty that keeps the air above
// the dew point.
double CoolingController::DutyLimit() {
  const bool measured = unit_ && unit_->humidity_pct >= 1 && unit_->humidity_pct <= 100;
  const double humidity_pct = measured ? unit_->humidity_pct : config_.assumed_humidity_pct;
  const auto dew = DewPoint_degc(input_->ambient_degc, humidity_pct);
  if (!dew.ok()) {
    return std::min(config_.safe_duty, config_.max_duty);
  }
  const double share = (input_->ambient_degc - (*dew + config_.dew_margin_k)) / config_.max_cooling_k;
  const double allowed = share >= 1 ? 1 : 1 - std::sqrt(1 - std::max(share, 0.0));
  const bool latch_on = input_->inlet_degc < *dew + config_.dew_off_margin_k;
  const bool latch_off = input_->inlet_degc > *dew + config_.dew_off_margin_k + config_.hysteresis_k;
  dew_latched_ = latch_on || (dew_latched_ && !latch_off);
  return std::min(allowed, config_.max_duty);
}

bool CoolingController::CoolerOff(std::int64_t now_us) {
  const bool no_flow = no_flow_since_us_ && Seconds(now_us - *no_flow_since_us_) >= config_.flow_grace_s;
  if (input_ && input_->hot_side_degc > config_.hot_side_off_degc) {
    hot_side_latched_ = true;
  } else if (input_ && input_->hot_side_degc < config_.hot_side_off_degc - config_.hysteresis_k) {
    hot_side_latched_ = false;
  }
  return no_flow || hot_side_latched_ || dew_latched_;
}

CoolingController::Judgement CoolingController::Judge(std::int64_t now_us) {
  const double limits_degc[] = {config_.warn_degc, config_.stop_degc, config_.power_off_degc};
  const Interlock levels[] = {Interlock::kWarn, Interlock::kStopInspection, Interlock::kPowerOff};
  Interlock level = Interlock::kClear;
  for (int i = 0; i < 3 && std::isfinite(inside_degc_); ++i) {
    const double limit_degc = limits_degc[i] - (level_ >= levels[i] ? config_.hysteresis_k : 0);
    level = inside_degc_ > limit_degc ? levels[i] : level;
  }
  level_ = std::isfinite(inside_degc_) ? level : level_;
  Judgement judgement{level_, ""};
  if (level_ != Interlock::kClear) {
    judgement.reason = fmt::format("the scanner is at {:.1f} degC", inside_degc_);
  }
  if (blind_since_us_ && Seconds(now_us - *blind_since_us_) >= config_.blind_stop_s) {
    judgement = {
        std::max(level_, Interlock::kStopInspection),
        fmt::format("no thermometer of the scanner for {:.0f} s", Seconds(now_us - *blind_since_us_))};
  }
  const bool cooler_off = CoolerOff(now_us);
  const bool trouble = !sensor_fault_.empty() || !fresh_ || cooler_off || !link_up_;
  if (trouble && judgement.interlock == Interlock::kClear) {
    judgement.interlock = Interlock::kWarn;
    judgement.reason = !link_up_    ? "the cooling unit does not answer"
                       : !fresh_    ? "the temperatures are stale"
                       : cooler_off ? (hot_side_latched_ ? "cooler off: its hot side is too hot"
                                       : dew_latched_    ? "cooler off: the air is near its dew point"
                                                         : "cooler off: no air flow")
                                    : sensor_fault_;
  }
  return judgement;
}

CoolingOutput CoolingController::Tick(std::int64_t now_us) {
  const double dt_s = std::clamp(Seconds(now_us - last_tick_us_.value_or(now_us)), 0.0, kLongestTick_s);
  last_tick_us_ = now_us;
  fresh_ = input_ && Seconds(now_us - input_->utime) <= config_.stale_s;
  const bool sighted = fresh_ && std::isfinite(inside_degc_);
  if (sighted) {
    blind_since_us_.reset();
  } else if (!blind_since_us_) {
    blind_since_us_ = now_us;
  }
  duty_ = sighted ? Regulate(dt_s) : Slewed(config_.safe_duty, dt_s);
  const Judgement judgement = Judge(now_us);
  if (CoolerOff(now_us)) {
    duty_ = 0;  // at once: the slew limit spares the cooler, an interlock spares the scanner
  }
  CoolingOutput output;
  output.duty = duty_;
  output.interlock = input_ ? judgement.interlock : Interlock::kUnknown;
  output.reason = input_ ? judgement.reason : "no temperatures yet";
  output.projector_off = judgement.interlock >= Interlock::kStopInspection;
  output.sensor_power_off = judgement.interlock == Interlock::kPowerOff;
  output.inside_degc = sighted ? inside_degc_ : kNaN;
  return output;
}

}  // namespace forgescan
