#include "drivers/line/line_sim.h"

#include <cmath>

namespace forgescan {
namespace {

constexpr std::int64_t kReportPeriod_us = 100'000;

}  // namespace

Status LineSim::Send(const LineCommand& command) {
  const bool repeated =
      echo_.gate != GateState::kUnknown && command.seq == echo_.seq_echo && command.part == echo_.part;
  if (!repeated) {
    echo_ = {.part = command.part,
             .verdict = faults_.wrong_echo ? LineVerdict::kUnknown : command.verdict,
             .gate = GateState::kMoving,
             .seq_echo = command.seq};
    gate_done_us_ = now_us_ + config_.gate_us;
    sorted_.push_back(command);
  }
  Echo();
  return {};
}

void LineSim::Echo() {
  echo_.utime = now_us_;
  if (!faults_.lost_echo) {
    Emit(echo_);
  }
}

void LineSim::MoveGate() {
  if (echo_.gate == GateState::kMoving && now_us_ >= gate_done_us_) {
    echo_.gate = faults_.stuck_valve ? GateState::kStuck : GateState::kDone;
    Echo();
  }
}

void LineSim::MoveParts() {
  bool changed = false;
  if (part_.in_place && now_us_ >= in_place_us_ + config_.dwell_us) {
    part_.in_place = false;
    part_.clamped = false;
    changed = true;
  }
  const bool more = config_.parts == 0 || arrived_ < config_.parts;
  if (more && now_us_ >= next_part_us_ + faults_.late_us) {
    part_.part = config_.first_part + static_cast<std::uint32_t>(arrived_);
    part_.in_place = true;
    part_.clamped = true;
    in_place_us_ = now_us_;
    next_part_us_ = now_us_ + config_.takt_us;
    ++arrived_;
    changed = true;
  }
  part_.utime = now_us_;
  part_.in_place_ms = part_.in_place ? static_cast<std::uint32_t>((now_us_ - in_place_us_) / 1000) : 0;
  if (changed || now_us_ >= next_report_us_) {
    Emit(part_);
  }
}

void LineSim::ReportPyrometer() {
  LinePyrometer reading{.utime = now_us_, .part = part_.part};
  if (part_.in_place && temperature_ && !faults_.pyrometer_blind) {
    const double degc = temperature_(part_.part, now_us_ - in_place_us_);
    reading.valid = !std::isnan(degc);
    reading.part_degc = reading.valid ? degc : reading.part_degc;
  }
  Emit(reading);
}

void LineSim::Step(std::int64_t now_us) {
  now_us_ = now_us;
  if (!started_) {
    started_ = true;
    part_.running = true;
    next_part_us_ = now_us + config_.first_after_us;
    next_report_us_ = now_us;
    Emit(DeviceLink{true});
  }
  MoveParts();
  MoveGate();
  if (now_us >= next_report_us_) {
    next_report_us_ = now_us + kReportPeriod_us;
    ReportPyrometer();
  }
}

}  // namespace forgescan
