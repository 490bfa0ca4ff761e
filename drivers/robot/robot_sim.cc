#include "drivers/robot/robot_sim.h"

#include <algorithm>

namespace forgescan {
namespace {

constexpr std::int64_t kReportPeriod_us = 100'000;
constexpr std::uint16_t kEmergencyViewRefused = 0xFF01;
constexpr std::uint16_t kEmergencyStopped = 0xFF00;

}  // namespace

Status RobotSim::Send(const RobotCommand& command) {
  if (faults_.deaf || (has_seq_ && command.seq == status_.seq_echo)) {
    return {};
  }
  Execute(command);
  return {};
}

// A run along the path takes its views in order; the same view may be taken again, and view 0 begins a new
// run.
bool RobotSim::MayGo(std::uint16_t view) const {
  const bool in_order = view == 0 || view == last_view_ || view == last_view_ + 1;
  const bool able = status_.state != RobotState::kFault && status_.state != RobotState::kPaused;
  return able && status_.path_valid && in_order && view < config_.view_count;
}

void RobotSim::Execute(const RobotCommand& command) {
  const bool refused = (command.order == RobotOrder::kGoView && !MayGo(command.view)) ||
                       (command.order == RobotOrder::kSelectPath && command.path != config_.path) ||
                       (command.order == RobotOrder::kHome && status_.state == RobotState::kFault);
  if (refused) {
    Emit(DeviceFault{kEmergencyViewRefused, command.seq | static_cast<std::uint32_t>(command.view) << 16});
    return;
  }
  has_seq_ = true;
  ++executed_;
  status_.seq_echo = command.seq;
  status_.path = command.path;
  status_.view = static_cast<std::uint16_t>(command.view + (faults_.wrong_view_echo ? 1 : 0));
  switch (command.order) {
    case RobotOrder::kNop:
      break;
    case RobotOrder::kSelectPath:
      status_.path_valid = true;
      break;
    case RobotOrder::kGoView:
      last_view_ = command.view;
      StartMove(RobotState::kInPosition);
      break;
    case RobotOrder::kHome:
      last_view_ = -1;
      StartMove(RobotState::kHome);
      break;
    case RobotOrder::kPause:
    case RobotOrder::kAbort:
      status_.state = command.order == RobotOrder::kPause ? RobotState::kPaused : RobotState::kIdle;
      status_.in_position = false;
      break;
    case RobotOrder::kResetFault:
      if (!faults_.protective_stop && status_.state == RobotState::kFault) {
        status_.state = RobotState::kIdle;
        status_.protective_stop = false;
        Emit(DeviceFault{0, 0});
      }
      break;
  }
}

void RobotSim::StartMove(RobotState goal) {
  goal_ = goal;
  status_.state = RobotState::kMoving;
  status_.in_position = false;
  move_start_us_ = now_us_;
}

double RobotSim::progress() const {
  if (status_.state != RobotState::kMoving) {
    return 1;
  }
  const double passed = static_cast<double>(now_us_ - move_start_us_) / static_cast<double>(config_.move_us);
  return std::clamp(passed, 0.0, 1.0);
}

void RobotSim::Advance() {
  const std::int64_t moving_us = now_us_ - move_start_us_;
  if (status_.state == RobotState::kMoving && moving_us >= config_.move_us && !faults_.stuck) {
    status_.state = goal_ == RobotState::kHome ? RobotState::kHome : RobotState::kSettling;
  }
  if (status_.state == RobotState::kSettling && moving_us >= config_.move_us + 1000 * config_.settle_ms) {
    status_.state = RobotState::kInPosition;
    status_.in_position = true;
    in_position_us_ = now_us_;
  }
  if (status_.state == RobotState::kInPosition) {
    status_.in_position = !faults_.leaves_position;
  }
}

void RobotSim::Fault() {
  if (faults_.protective_stop && status_.state != RobotState::kFault) {
    status_.state = RobotState::kFault;
    status_.in_position = false;
    status_.protective_stop = true;
    Emit(DeviceFault{kEmergencyStopped, 0});
  }
}

void RobotSim::SetBodyTemperature(double body_degc, bool warm) {
  config_.body_degc = body_degc;
  config_.warm = warm;
}

void RobotSim::Report(bool because_changed) {
  reported_ = status_;
  status_.utime = now_us_;
  if (!faults_.lost_echo) {
    Emit(status_);
  }
  reported_.utime = status_.utime;
  if (because_changed) {
    return;
  }
  const std::int64_t held_us = status_.in_position ? now_us_ - in_position_us_ : 0;
  Emit(RobotMotion{now_us_, static_cast<std::uint32_t>(held_us / 1000), config_.body_degc, 100});
}

void RobotSim::Step(std::int64_t now_us) {
  now_us_ = now_us;
  if (!started_) {
    started_ = true;
    status_.state = RobotState::kHome;
    status_.automatic = true;
    status_.drives_on = true;
    next_report_us_ = now_us;
    Emit(DeviceLink{true});
    Emit(RobotPath{config_.view_count, config_.path_crc32, config_.settle_ms, config_.move_timeout_ms});
  }
  status_.warm = config_.warm;
  Fault();
  Advance();
  reported_.utime = status_.utime;
  const bool due = now_us >= next_report_us_;
  if (due) {
    next_report_us_ = now_us + kReportPeriod_us;
  }
  if (due || !(status_ == reported_)) {
    Report(!due);
  }
}

}  // namespace forgescan
