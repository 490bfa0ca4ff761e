#include "drivers/trigger/trigger_canopen.h"

namespace forgescan {

Result<std::vector<CanFrame>> TriggerProtocol::FramesOf(const TriggerCommand& command) {
  station::TriggerTiming timing;
  timing.seq = command.seq;
  timing.exposure_us = command.exposure_us;
  timing.first_pattern = command.first_pattern;
  timing.cameras = command.cameras;
  station::TriggerCommand wire;
  wire.seq = command.seq;
  wire.mode = static_cast<station::TriggerCommand::Mode>(command.mode);
  wire.view = command.view;
  wire.pulses = command.pulses;
  wire.period_us = command.period_us;
  ASSIGN_OR_RETURN(const CanFrame first, timing.Encode());
  ASSIGN_OR_RETURN(const CanFrame second, wire.Encode());
  return std::vector<CanFrame>{first, second};
}

Result<std::optional<TriggerCommand>> TriggerProtocol::CommandOf(const CanFrame& frame) {
  if (frame.id == station::TriggerTiming::kId) {
    ASSIGN_OR_RETURN(timing_, station::TriggerTiming::Decode(frame));
    return std::optional<TriggerCommand>();
  }
  if (frame.id != station::TriggerCommand::kId) {
    return std::optional<TriggerCommand>();
  }
  ASSIGN_OR_RETURN(const auto wire, station::TriggerCommand::Decode(frame));
  if (!timing_ || timing_->seq != wire.seq) {
    return Fail(ErrorCode::kProtocol, "TriggerCommand of seq {} came without its TriggerTiming", wire.seq);
  }
  TriggerCommand command;
  command.seq = wire.seq;
  command.mode = static_cast<TriggerMode>(wire.mode);
  command.view = wire.view;
  command.pulses = wire.pulses;
  command.period_us = wire.period_us;
  command.exposure_us = timing_->exposure_us;
  command.first_pattern = timing_->first_pattern;
  command.cameras = timing_->cameras;
  return std::optional(command);
}

Result<std::optional<TriggerEvent>> TriggerProtocol::EventOf(const CanFrame& frame) {
  if (frame.id == station::TriggerStatus::kId) {
    ASSIGN_OR_RETURN(const auto wire, station::TriggerStatus::Decode(frame));
    return std::optional<TriggerEvent>(TriggerStatus{frame.utime, wire.seq_echo,
                                                     static_cast<TriggerState>(wire.state), wire.pulses_done,
                                                     wire.device_time_us});
  }
  if (frame.id == station::TriggerPulse::kId) {
    ASSIGN_OR_RETURN(const auto wire, station::TriggerPulse::Decode(frame));
    return std::optional<TriggerEvent>(TriggerPulse{frame.utime, wire.seq_low, wire.right, wire.pattern,
                                                    wire.pulse, wire.exposure_us, wire.device_time_us});
  }
  return std::optional<TriggerEvent>();
}

Result<std::vector<CanFrame>> TriggerProtocol::FramesOf(const TriggerEvent& event) {
  if (const auto* status = std::get_if<TriggerStatus>(&event)) {
    station::TriggerStatus wire;
    wire.seq_echo = status->seq_echo;
    wire.state = static_cast<station::TriggerStatus::State>(status->state);
    wire.pulses_done = status->pulses_done;
    wire.device_time_us = status->device_time_us;
    ASSIGN_OR_RETURN(const CanFrame frame, wire.Encode());
    return std::vector<CanFrame>{frame};
  }
  if (const auto* pulse = std::get_if<TriggerPulse>(&event)) {
    station::TriggerPulse wire;
    wire.seq_low = pulse->seq_low;
    wire.right = pulse->right;
    wire.pattern = pulse->pattern;
    wire.pulse = pulse->pulse;
    wire.exposure_us = pulse->exposure_us;
    wire.device_time_us = pulse->device_time_us;
    ASSIGN_OR_RETURN(const CanFrame frame, wire.Encode());
    return std::vector<CanFrame>{frame};
  }
  return std::vector<CanFrame>();
}

std::unique_ptr<Trigger> MakeCanTrigger(CanBus& bus) {
  return std::make_unique<CanopenHost<TriggerProtocol>>(bus);
}

}  // namespace forgescan
