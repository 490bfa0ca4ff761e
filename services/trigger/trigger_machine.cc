#include "services/trigger/trigger_machine.h"

#include <fmt/core.h>

#include <algorithm>
#include <bit>

namespace forgescan {
namespace {

constexpr std::int64_t kUsPerMs = 1000;
constexpr std::uint16_t kPulseModulus = 4096;  // of the count on the wire

}  // namespace

TriggerMachine::TriggerMachine(const TriggerConfig& config) : config_(config) {
  const auto plan = PlanTrigger(config);
  assert(plan.ok());
  plan_ = *plan;
}

TriggerCommand TriggerMachine::Command(TriggerMode mode) const {
  return {.seq = seq_,
          .mode = mode,
          .view = static_cast<std::uint16_t>(view_.view & 0xFFF),
          .pulses = static_cast<std::uint8_t>(config_.patterns),
          .period_us = static_cast<std::uint32_t>(plan_.period_us),
          .exposure_us = static_cast<std::uint16_t>(config_.exposure_us),
          .first_pattern = static_cast<std::uint8_t>(config_.first_pattern),
          .cameras = 2};
}

ViewOutcome TriggerMachine::Outcome(std::int64_t utime) const {
  return {.view = view_,
          .utime = utime,
          .captured = false,
          .pulses_expected = config_.patterns,
          .pulses = {std::popcount(seen_[0]), std::popcount(seen_[1])},
          .reason = ""};
}

TriggerMachine::Actions TriggerMachine::Void(const std::string& reason, std::int64_t now_us) {
  Actions actions;
  ViewOutcome outcome = Outcome(now_us);
  outcome.reason = reason;
  if (phase_ != TriggerPhase::kOffline) {
    phase_ = TriggerPhase::kIdle;
    ++seq_;
    actions.emplace_back(Command(TriggerMode::kAbort));
  }
  actions.emplace_back(outcome);
  return actions;
}

TriggerMachine::Actions TriggerMachine::Forget(const std::string& reason, std::int64_t now_us) {
  const bool was_active = active();
  phase_ = TriggerPhase::kOffline;  // idle begins with the first status
  clock_.Reset();
  pulse_count_ = {};
  return was_active ? Void(reason, now_us) : Actions{};
}

TriggerMachine::Actions TriggerMachine::OnLink(bool up, std::int64_t now_us) {
  link_up_ = up;
  return Forget("the trigger microcontroller stopped answering", now_us);
}

TriggerMachine::Actions TriggerMachine::OnViewReady(const ViewRequest& request, std::int64_t now_us) {
  if (phase_ != TriggerPhase::kIdle || stop_) {
    ViewOutcome refused{.view = request, .utime = now_us, .pulses_expected = config_.patterns};
    refused.reason = stop_ ? stop_reason_
                     : phase_ == TriggerPhase::kOffline
                         ? "the trigger microcontroller does not answer"
                         : fmt::format("view {} is still being captured", view_.view);
    return {refused};
  }
  view_ = request;
  seen_ = {};
  ++seq_;
  sent_ = 1;
  phase_ = TriggerPhase::kArming;
  deadline_us_ = now_us + config_.echo_timeout_ms * kUsPerMs;
  return {Command(TriggerMode::kFire)};
}

TriggerMachine::Actions TriggerMachine::OnPosition(bool in_position, std::int64_t now_us) {
  return active() && !in_position ? Void("the robot left its position during the exposure", now_us)
                                  : Actions{};
}

TriggerMachine::Actions TriggerMachine::OnInterlock(bool stop, const std::string& reason,
                                                    std::int64_t now_us) {
  stop_ = stop;
  stop_reason_ = fmt::format("cooling interlock: {}", reason);
  return active() && stop ? Void(stop_reason_, now_us) : Actions{};
}

TriggerMachine::Actions TriggerMachine::OnFault(const DeviceFault& fault, std::int64_t now_us) {
  if (fault.code == 0) {
    return {};
  }
  const std::string text =
      fmt::format("the trigger microcontroller reports fault {:#06x} ({})", fault.code, fault.detail);
  return active() ? Void(text, now_us) : Actions{TriggerNote{text}};
}

void TriggerMachine::Accept(std::int64_t now_us) {
  phase_ = TriggerPhase::kFiring;
  deadline_us_ = now_us + plan_.view_us + config_.record_timeout_ms * kUsPerMs;
}

TriggerMachine::Actions TriggerMachine::OnStatus(const TriggerStatus& status) {
  Actions actions;
  if (clock_.HasRestarted(status.device_time_us, status.utime)) {
    const std::string reason = "the trigger microcontroller was started again";
    actions = Forget(reason, status.utime);
    actions.emplace_back(TriggerNote{reason});
  }
  clock_.OnStatus(status.device_time_us, status.utime);
  if (link_up_ && phase_ == TriggerPhase::kOffline) {
    seq_ = status.seq_echo;  // commands go on from its number: one it has had before would be taken for a
                             // repetition
    phase_ = TriggerPhase::kIdle;
  }
  if (phase_ == TriggerPhase::kArming && status.seq_echo == seq_) {
    Accept(status.utime);
  }
  return actions;
}

bool TriggerMachine::Complete() const {
  return std::popcount(seen_[0]) == config_.patterns && std::popcount(seen_[1]) == config_.patterns;
}

TriggerMachine::Actions TriggerMachine::OnPulse(const TriggerPulse& pulse) {
  const int index = pulse.pattern - config_.first_pattern;
  const bool ours = active() && pulse.seq_low == (seq_ & 3) && index >= 0 && index < config_.patterns;
  const auto device_us = clock_.Unwrap(pulse.device_time_us);
  if (!ours || !device_us) {
    return {TriggerNote{fmt::format("record of pattern {} belongs to no view under way", pulse.pattern)}};
  }
  if (phase_ == TriggerPhase::kArming) {
    Accept(pulse.utime);  // the echo was lost, the command was not
  }
  const std::size_t camera = pulse.right ? 1 : 0;
  const std::uint32_t bit = std::uint32_t{1} << index;
  if ((seen_[camera] & bit) != 0) {
    return {TriggerNote{fmt::format("record of pattern {} came twice", pulse.pattern)}};
  }
  seen_[camera] |= bit;
  const int step = (pulse.pulse - pulse_count_[camera] % kPulseModulus + kPulseModulus) % kPulseModulus;
  pulse_count_[camera] += step;
  const std::int64_t at_us = clock_.ToStation(*device_us).value_or(pulse.utime);
  last_exposure_us_ = at_us + pulse.exposure_us;
  Actions actions{ExposureRecord{.view = view_,
                                 .utime = at_us,
                                 .right = pulse.right,
                                 .pattern = pulse.pattern,
                                 .pulse = pulse_count_[camera],
                                 .device_time_us = *device_us,
                                 .exposure_us = pulse.exposure_us}};
  if (Complete()) {
    phase_ = TriggerPhase::kIdle;
    ViewOutcome outcome = Outcome(last_exposure_us_);
    outcome.captured = true;
    actions.emplace_back(outcome);
  }
  return actions;
}

TriggerMachine::Actions TriggerMachine::OnTick(std::int64_t now_us) {
  if (!active() || now_us < deadline_us_) {
    return {};
  }
  if (phase_ == TriggerPhase::kFiring) {
    return Void(fmt::format("pulses missing: {} left, {} right of {}", std::popcount(seen_[0]),
                            std::popcount(seen_[1]), config_.patterns),
                now_us);
  }
  if (sent_ > config_.resends) {
    return Void(fmt::format("the trigger microcontroller did not echo the command, sent {} times", sent_),
                now_us);
  }
  ++sent_;
  deadline_us_ = now_us + config_.echo_timeout_ms * kUsPerMs;
  return {Command(TriggerMode::kFire)};
}

}  // namespace forgescan
