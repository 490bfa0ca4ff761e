#include "drivers/cooling/cooling_sim.h"

#include <algorithm>
#include <limits>

namespace forgescan {
namespace {

constexpr std::int64_t kReportPeriod_us = 100'000;
constexpr std::int64_t kCommandTimeout_us = 1'000'000;
constexpr double kLongestStep_s = 0.1;
constexpr std::uint16_t kEmergencyCommandTimeout = 0x8250;

}  // namespace

CoolingSim::CoolingSim(const CoolingSimConfig& config)
    : config_(config),
      random_(config.seed),
      inside_degc_(config.start_inside_degc),
      last_outlet_degc_(inside_degc_) {}

Status CoolingSim::Send(const CoolingCommand& command) {
  if (!(command.duty >= 0 && command.duty <= 1)) {
    return Fail(ErrorCode::kInvalidArgument, "cooling duty {} is outside 0..1", command.duty);
  }
  if (state_ == CoolingUnitState::kSafe) {
    Emit(DeviceFault{0, 0});
  }
  command_ = command;
  last_command_us_ = now_us_;
  state_ = command.pump_on ? CoolingUnitState::kRunning : CoolingUnitState::kStopped;
  return {};
}

void CoolingSim::CheckCommandAge() {
  if (state_ == CoolingUnitState::kRunning && now_us_ - last_command_us_ > kCommandTimeout_us) {
    state_ = CoolingUnitState::kSafe;
    command_ = {.duty = config_.safe_duty, .pump_on = true};
    Emit(DeviceFault{kEmergencyCommandTimeout, 0});
  }
}

// Cooling follows 2d - d^2: the heat pumped grows with the current, the heat made with its square.
void CoolingSim::Integrate(double seconds) {
  const bool flows = command_.pump_on && !faults_.pump_dead;
  const double wanted_k = flows ? config_.max_cooling_k * command_.duty * (2 - command_.duty) : 0;
  const double conductance = flows ? config_.flow_conductance_w_per_k : config_.still_conductance_w_per_k;
  const double electronics_w = command_.sensor_power_off ? 0 : config_.electronics_w;
  while (seconds > 0) {
    const double dt = std::min(seconds, kLongestStep_s);
    seconds -= dt;
    cooled_k_ += dt * (wanted_k - cooled_k_) / config_.cooler_lag_s;
    const double air_degc = config_.ambient_degc - cooled_k_;
    const double net_w = electronics_w + heat_load_w_ - conductance * (inside_degc_ - air_degc);
    inside_degc_ += dt * net_w / config_.heat_capacity_j_per_k;
  }
}

double CoolingSim::Noisy(double degc) {
  return degc + std::normal_distribution<double>(0, config_.noise_k)(random_);
}

void CoolingSim::Report() {
  constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
  const bool flows = command_.pump_on && !faults_.pump_dead;
  if (!faults_.outlet_frozen) {
    last_outlet_degc_ = Noisy(inside_degc_) + faults_.outlet_jump_k;
  }
  CoolingTemperatures temperatures;
  temperatures.utime = now_us_;
  temperatures.inlet_degc = faults_.inlet_dead ? kNaN : Noisy(config_.ambient_degc - cooled_k_);
  temperatures.outlet_degc = faults_.outlet_dead ? kNaN : last_outlet_degc_;
  temperatures.ambient_degc = Noisy(config_.ambient_degc);
  temperatures.hot_side_degc =
      Noisy(config_.ambient_degc + config_.hot_side_rise_k * command_.duty * command_.duty);
  CoolingStatus status;
  status.utime = now_us_;
  status.state = state_;
  status.duty = command_.duty;
  status.flow_lpm = flows ? config_.flow_lpm : 0;
  status.pump_on = command_.pump_on;
  status.projector_off = command_.projector_off;
  status.sensor_power_off = command_.sensor_power_off;
  status.humidity_pct = config_.humidity_pct;
  Emit(status);
  if (!faults_.silent) {
    Emit(temperatures);
  }
}

void CoolingSim::Step(std::int64_t now_us) {
  if (!started_) {
    started_ = true;
    now_us_ = now_us;
    next_report_us_ = now_us;
    state_ = CoolingUnitState::kStopped;
    Emit(DeviceLink{true});
  }
  Integrate(1e-6 * static_cast<double>(now_us - now_us_));
  now_us_ = now_us;
  CheckCommandAge();
  if (now_us >= next_report_us_) {
    next_report_us_ = now_us + kReportPeriod_us;
    Report();
  }
}

}  // namespace forgescan
