// The parts of the robot's machine that follow the line: which part is taken up, refused, or passes by.
#include <fmt/format.h>

#include <limits>

#include "services/robot/robot_machine.h"

namespace forgescan {
namespace {

constexpr std::int32_t kLastPart = std::numeric_limits<std::int32_t>::max();

}  // namespace

bool RobotMachine::HasNumber() const {
  return line_part_.in_place && line_part_.part >= 1 &&
         line_part_.part <= static_cast<std::uint32_t>(kLastPart);
}

// Why a part cannot be inspected now; empty when it can.
std::string RobotMachine::WhyNot() const {
  if (stop_) {
    return stop_reason_;
  }
  if (!hold_reason_.empty()) {
    return hold_reason_;
  }
  if (!path_ || !status_ || path_->view_count == 0) {
    return "the robot controller has no taught path";
  }
  if (config_.path_crc32 != 0 && path_->crc32 != config_.path_crc32) {
    return fmt::format("the taught path has CRC {:#010x}, the view matrices belong to {:#010x}", path_->crc32,
                       config_.path_crc32);
  }
  if (!status_->automatic || !status_->drives_on) {
    return "the robot is not in automatic mode with its drives on";
  }
  if (config_.require_warm && !status_->warm) {
    return fmt::format("the robot is not warm yet ({:.1f} degC)", body_degc_);
  }
  return "";
}

RobotMachine::Actions RobotMachine::Start(std::int64_t now_us) {
  part_ = static_cast<std::int32_t>(line_part_.part);
  last_part_ = part_;
  start_us_ = line_part_.utime;
  view_ = attempt_ = captured_ = 0;
  void_reason_.clear();
  Actions actions{PartStarted{start_us_, part_, path_ ? path_->view_count : 0, path_ ? path_->crc32 : 0}};
  if (const std::string why_not = WhyNot(); !why_not.empty()) {
    actions.emplace_back(ScanFinished{now_us, start_us_, part_, path_ ? path_->view_count : 0, 0, why_not});
    return actions;
  }
  phase_ = RobotPhase::kSelecting;
  Append(actions, Order(RobotOrder::kSelectPath, now_us));
  return actions;
}

RobotMachine::Actions RobotMachine::PassBy(std::int64_t now_us) {
  const auto leaving = static_cast<std::int32_t>(line_part_.part);
  if (!HasNumber() || leaving == last_part_ || scanning()) {
    return {};
  }
  last_part_ = leaving;
  const std::int32_t views = path_ ? path_->view_count : 0;
  const std::string why_not = WhyNot();
  return {
      PartStarted{line_part_.utime, leaving, views, path_ ? path_->crc32 : 0},
      ScanFinished{now_us, line_part_.utime, leaving, views, 0,
                   "the part left before the robot could begin" + (why_not.empty() ? "" : ": " + why_not)}};
}

RobotMachine::Actions RobotMachine::OnLineLink(bool up, std::int64_t now_us) {
  if (up) {
    return {};
  }
  line_part_ = {};
  return scanning() ? Abort("the line's signals stopped", now_us) : Actions{};
}

RobotMachine::Actions RobotMachine::OnPart(const LinePart& part, std::int64_t now_us) {
  Actions passed;
  const bool changed = part.part != line_part_.part || part.in_place != line_part_.in_place;
  if (changed) {  // the time of arrival stays that of the first report
    Append(passed, PassBy(now_us));
    line_part_ = part;
    if (!part.in_place) {
      last_part_.reset();  // the next one may have the same number
    } else if (!HasNumber()) {
      passed.emplace_back(RobotNote{fmt::format(
          "the line calls a part {}: not inspected, parts are numbered 1 to {}", part.part, kLastPart)});
    }
  }
  if (scanning()) {
    const bool ours = part.in_place && static_cast<std::int32_t>(part.part) == part_;
    if (!ours) {
      Append(passed, Abort(fmt::format("part {} left its place during the scan", part_), now_us));
    }
    return passed;
  }
  const bool new_part = HasNumber() && static_cast<std::int32_t>(line_part_.part) != last_part_;
  const bool possible = phase_ == RobotPhase::kReady && status_.has_value();
  if (new_part && possible) {
    Append(passed, Start(now_us));
  }
  return passed;
}

}  // namespace forgescan
