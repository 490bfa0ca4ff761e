#include "services/robot/robot_machine.h"

#include <fmt/core.h>

#include <algorithm>
#include <iterator>

namespace forgescan {
namespace {

constexpr std::int64_t kUsPerMs = 1000;

std::int64_t FromSeconds(double seconds) { return static_cast<std::int64_t>(seconds * 1e6); }

}  // namespace

void Append(RobotMachine::Actions& actions, RobotMachine::Actions more) {
  actions.insert(actions.end(), std::make_move_iterator(more.begin()), std::make_move_iterator(more.end()));
}

std::string RobotMachine::Text() const {
  switch (phase_) {
    case RobotPhase::kOffline:
      return "the robot controller does not answer";
    case RobotPhase::kReady:
      return "waiting for a part";
    case RobotPhase::kSelecting:
      return fmt::format("part {}: selecting path {}", part_, config_.path);
    case RobotPhase::kApproaching:
      return fmt::format("part {}: approaching view {}", part_, view_);
    case RobotPhase::kCapturing:
      return fmt::format("part {}: capturing view {}", part_, view_);
    case RobotPhase::kHoming:
      return "going home";
    case RobotPhase::kFault:
      break;
  }
  return "the robot is in fault";
}

RobotMachine::Actions RobotMachine::Order(RobotOrder order, std::int64_t now_us) {
  const std::uint16_t view =
      order == RobotOrder::kGoView ? static_cast<std::uint16_t>(view_) : std::uint16_t{0};
  order_ = {static_cast<std::uint16_t>(order_.seq + 1), order, static_cast<std::uint16_t>(config_.path),
            view};
  echoed_ = false;
  sent_ = 1;
  echo_deadline_us_ = now_us + config_.echo_timeout_ms * kUsPerMs;
  return {order_};
}

RobotMachine::Actions RobotMachine::GoHome(std::int64_t now_us) {
  if (phase_ == RobotPhase::kOffline) {
    return {};
  }
  phase_ = RobotPhase::kHoming;
  deadline_us_ = now_us + FromSeconds(config_.home_timeout_s);
  return Order(RobotOrder::kHome, now_us);
}

RobotMachine::Actions RobotMachine::Abort(const std::string& reason, std::int64_t now_us) {
  Actions actions;
  if (scanning()) {
    actions.emplace_back(
        ScanFinished{now_us, start_us_, part_, path_ ? path_->view_count : 0, captured_, reason});
  } else {
    actions.emplace_back(RobotNote{reason});
  }
  const bool stopped = status_ && (status_->state == RobotState::kFault || status_->protective_stop);
  if (stopped) {
    phase_ = RobotPhase::kFault;
  } else {
    Append(actions, GoHome(now_us));
  }
  return actions;
}

RobotMachine::Actions RobotMachine::Approach(std::int64_t now_us) {
  phase_ = RobotPhase::kApproaching;
  in_position_since_us_.reset();
  deadline_us_ = now_us + path_->move_timeout_ms * kUsPerMs;
  return Order(RobotOrder::kGoView, now_us);
}

RobotMachine::Actions RobotMachine::OnLink(bool up, std::int64_t now_us) {
  Actions actions;
  if (scanning()) {
    actions.emplace_back(ScanFinished{now_us, start_us_, part_, path_ ? path_->view_count : 0, captured_,
                                      "the robot controller stopped answering"});
  }
  phase_ = up ? RobotPhase::kHoming : RobotPhase::kOffline;  // homing begins with the first status
  status_.reset();
  path_.reset();
  return actions;
}

RobotMachine::Actions RobotMachine::OnStop(std::int64_t now_us) {
  return scanning() ? Abort("the robot service was stopped", now_us) : Actions{};
}

RobotMachine::Actions RobotMachine::OnPath(const RobotPath& path) {
  path_ = path;
  return {};
}

RobotMachine::Actions RobotMachine::OnMotion(const RobotMotion& motion) {
  body_degc_ = motion.body_degc;
  return {};
}

RobotMachine::Actions RobotMachine::OnFault(const DeviceFault& fault, std::int64_t now_us) {
  if (fault.code == 0) {
    return {};
  }
  const std::string text =
      fmt::format("the robot controller reports fault {:#06x} ({:#x})", fault.code, fault.detail);
  return scanning() ? Abort(text, now_us) : Actions{RobotNote{text}};
}

RobotMachine::Actions RobotMachine::OnPyrometer(const LinePyrometer& reading) {
  if (phase_ == RobotPhase::kCapturing && reading.valid && static_cast<std::int32_t>(reading.part) == part_) {
    readings_degc_.push_back(reading.part_degc);
  }
  return {};
}

bool RobotMachine::Echoed(const RobotStatus& status) const {
  return status.seq_echo == order_.seq && status.path == order_.path && status.view == order_.view;
}

RobotMachine::Actions RobotMachine::OnStatus(const RobotStatus& status) {
  const bool first = !status_.has_value();
  status_ = status;
  if (first) {  // orders go on from the controller's number: one it has had before would be taken for a
                // repetition
    order_.seq = status.seq_echo;
    return GoHome(status.utime);
  }
  if (scanning() && (status.state == RobotState::kFault || status.protective_stop)) {
    return Abort("the robot was stopped by a fault or its safety", status.utime);
  }
  if (phase_ == RobotPhase::kFault) {
    return status.state == RobotState::kFault || status.protective_stop ? Actions{} : GoHome(status.utime);
  }
  echoed_ = echoed_ || Echoed(status);
  if (!echoed_) {
    return {};
  }
  if (phase_ == RobotPhase::kSelecting) {
    return status.path_valid ? Approach(status.utime) : Actions{};
  }
  if (phase_ == RobotPhase::kHoming && status.state == RobotState::kHome) {
    phase_ = RobotPhase::kReady;
    return OnPart(line_part_, status.utime);  // a part that came meanwhile
  }
  return phase_ == RobotPhase::kApproaching ? Settle(status) : Actions{};
}

// Not before the controller has held the position for its settling time without a break.
RobotMachine::Actions RobotMachine::Settle(const RobotStatus& status) {
  const bool there = status.in_position && status.state == RobotState::kInPosition && Echoed(status);
  if (!there) {
    in_position_since_us_.reset();
    return {};
  }
  in_position_since_us_ = in_position_since_us_.value_or(status.utime);
  const std::int64_t held_us = status.utime - *in_position_since_us_;
  if (held_us < path_->settle_ms * kUsPerMs) {
    return {};
  }
  phase_ = RobotPhase::kCapturing;
  readings_degc_.clear();
  deadline_us_ = status.utime + FromSeconds(config_.capture_timeout_s);
  return {ViewSettled{status.utime, part_, view_, attempt_, 1e-3 * static_cast<double>(held_us), body_degc_}};
}

ViewTemperature RobotMachine::TakeTemperature(std::int64_t now_us) {
  return {now_us, part_, view_, std::exchange(readings_degc_, {})};
}

RobotMachine::Actions RobotMachine::NextView(std::int64_t now_us) {
  attempt_ = 0;
  if (++view_ < path_->view_count) {
    return Approach(now_us);
  }
  Actions actions{ScanFinished{now_us, start_us_, part_, path_->view_count, captured_, void_reason_}};
  Append(actions, GoHome(now_us));
  return actions;
}

RobotMachine::Actions RobotMachine::OnCapture(const CaptureReport& report, std::int64_t now_us) {
  const bool expected = phase_ == RobotPhase::kCapturing && report.part == part_ && report.view == view_ &&
                        report.attempt == attempt_;
  if (!expected) {
    return {RobotNote{fmt::format("report of part {} view {} attempt {} is not of a view being captured",
                                  report.part, report.view, report.attempt)}};
  }
  if (!report.captured && attempt_ + 1 < config_.max_attempts) {
    ++attempt_;
    return Approach(now_us);
  }
  if (!report.captured) {
    void_reason_ = fmt::format("view {} is void: {}", view_, report.reason);
  }
  captured_ += report.captured ? 1 : 0;
  Actions actions{TakeTemperature(report.utime)};
  Append(actions, NextView(now_us));
  return actions;
}

RobotMachine::Actions RobotMachine::OnInterlock(bool stop, const std::string& reason, std::int64_t now_us) {
  stop_ = stop;
  stop_reason_ = fmt::format("cooling interlock: {}", reason);
  return stop && scanning() ? Abort(stop_reason_, now_us) : Actions{};
}

RobotMachine::Actions RobotMachine::OnTick(std::int64_t now_us) {
  const bool ordered = status_.has_value() && (scanning() || phase_ == RobotPhase::kHoming);
  if (ordered && !echoed_ && now_us >= echo_deadline_us_) {
    if (sent_ > config_.resends && phase_ == RobotPhase::kHoming) {
      return GoHome(now_us);  // nothing else to do: keep asking until it answers or the link goes down
    }
    if (sent_ > config_.resends) {
      return Abort(fmt::format("the robot did not echo order {} of view {}, sent {} times", order_.seq,
                               order_.view, sent_),
                   now_us);
    }
    ++sent_;
    echo_deadline_us_ = now_us + config_.echo_timeout_ms * kUsPerMs;
    return {order_};
  }
  if (!ordered || phase_ == RobotPhase::kSelecting || now_us < deadline_us_) {
    return {};
  }
  if (phase_ == RobotPhase::kHoming) {
    Actions actions{RobotNote{fmt::format("the robot is not home after {} s", config_.home_timeout_s)}};
    Append(actions, GoHome(now_us));
    return actions;
  }
  return Abort(fmt::format("view {} was not {} in time", view_,
                           phase_ == RobotPhase::kCapturing ? "captured" : "reached"),
               now_us);
}

}  // namespace forgescan
