#include "drivers/trigger/trigger_sim.h"

#include <cmath>

namespace forgescan {
namespace {

constexpr std::int64_t kReportPeriod_us = 100'000;
constexpr std::int64_t kProjectorLead_us = 500;  // from the command to the first pattern
constexpr std::uint16_t kEmergencyBadCommand = 0xFF00;

}  // namespace

std::uint32_t TriggerSim::DeviceTime(std::int64_t utime) const {
  const double elapsed_us = static_cast<double>(utime - start_us_) * (1 + 1e-6 * config_.drift_ppm);
  return static_cast<std::uint32_t>(config_.device_time_at_start_us +
                                    static_cast<std::uint64_t>(std::llround(elapsed_us)));
}

Status TriggerSim::Send(const TriggerCommand& command) {
  if (faults_.deaf || (has_seq_ && command.seq == status_.seq_echo)) {
    return {};
  }
  const bool fire = command.mode == TriggerMode::kFire;
  const bool fits = 2 * std::uint32_t{command.exposure_us} <= command.period_us &&
                    command.first_pattern + command.pulses <= 32 && command.pulses > 0;
  const bool busy = status_.state == TriggerState::kFiring;
  if (fire && (!fits || busy)) {
    Emit(DeviceFault{kEmergencyBadCommand, command.seq});
    return {};
  }
  has_seq_ = true;
  status_.seq_echo = command.seq;
  if (fire) {
    Plan(command);
  } else if (command.mode == TriggerMode::kAbort) {
    planned_.clear();
    records_.clear();
    status_.state = TriggerState::kIdle;
  }
  Report();
  return {};
}

void TriggerSim::Plan(const TriggerCommand& command) {
  status_.state = TriggerState::kFiring;
  status_.pulses_done = 0;
  for (int i = 0; i < command.pulses; ++i) {
    for (int camera = 0; camera < command.cameras; ++camera) {
      const std::int64_t half_us = command.period_us / 2;
      const std::int64_t at_us =
          now_us_ + kProjectorLead_us + i * std::int64_t{command.period_us} + camera * half_us;
      const auto pattern = static_cast<std::uint8_t>(command.first_pattern + i);
      planned_.push_back({{camera == 1, command.view, pattern, at_us, command.exposure_us}, i});
    }
  }
}

void TriggerSim::Fire(const Planned& planned) {
  const Edge& edge = planned.edge;
  if (edge.right && planned.index == faults_.lose_pulse_of_view) {
    return;
  }
  std::uint16_t& fired = edge.right ? fired_right_ : fired_left_;
  ++fired;
  if (edge_handler_) {
    edge_handler_(edge);
  }
  const TriggerPulse pulse{.utime = 0,
                           .seq_low = static_cast<std::uint8_t>(status_.seq_echo & 3),
                           .right = edge.right,
                           .pattern = edge.pattern,
                           .pulse = static_cast<std::uint16_t>(fired % 4096),
                           .exposure_us = edge.exposure_us,
                           .device_time_us = DeviceTime(edge.utime)};
  if (planned.index == faults_.lose_record) {
    return;
  }
  for (int copy = 0; copy < (faults_.repeats_records ? 2 : 1); ++copy) {
    records_.emplace_back(edge.utime + edge.exposure_us, pulse);
  }
}

void TriggerSim::Report() {
  status_.utime = now_us_;
  status_.device_time_us = DeviceTime(now_us_);
  Emit(status_);
}

void TriggerSim::Step(std::int64_t now_us) {
  now_us_ = now_us;
  if (!started_) {
    started_ = true;
    start_us_ = now_us;
    next_report_us_ = now_us;
    status_.state = TriggerState::kIdle;
    Emit(DeviceLink{true});
  }
  while (!planned_.empty() && planned_.front().edge.utime <= now_us) {
    Fire(planned_.front());
    planned_.pop_front();
  }
  while (!records_.empty() && records_.front().first <= now_us) {
    TriggerPulse pulse = records_.front().second;
    records_.pop_front();
    pulse.utime = now_us;
    status_.pulses_done = static_cast<std::uint8_t>(status_.pulses_done + (pulse.right ? 0 : 1));
    Emit(pulse);
  }
  const bool finished = status_.state == TriggerState::kFiring && planned_.empty() && records_.empty();
  if (finished) {
    status_.state = TriggerState::kDone;
  }
  if (finished || now_us >= next_report_us_) {
    next_report_us_ = now_us + kReportPeriod_us;
    Report();
  }
}

}  // namespace forgescan
