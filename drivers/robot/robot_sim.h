// A robot controller in simulated time: moves that take their time, settling, refusals, and faults on
// request.
#pragma once

#include "drivers/robot/robot.h"

namespace forgescan {

struct RobotSimConfig {
  std::uint16_t view_count = 10;
  std::uint32_t path_crc32 = 0x1234ABCD;
  std::uint16_t path = 1;                // the one taught path
  std::uint16_t settle_ms = 200;         // stands still, controller has not yet reported "in position"
  std::uint16_t move_timeout_ms = 8000;  // what the controller tells the host
  std::int64_t move_us = 1'500'000;      // between neighbouring views, and home
  double body_degc = 35;
  bool warm = true;
};

// Faults are switched by the test or the scenario and stay until switched back.
struct RobotSimFaults {
  bool lost_echo = false;        // orders arrive, and are carried out, but no status tells
  bool deaf = false;             // orders do not arrive
  bool stuck = false;            // a move never ends
  bool protective_stop = false;  // as if the guard had been opened
  bool leaves_position = false;  // "in position" drops while it should be held
  bool wrong_view_echo = false;  // echoes the view after the one ordered
};

class RobotSim final : public Robot {
 public:
  explicit RobotSim(const RobotSimConfig& config = {}) : config_(config) {}

  Status Send(const RobotCommand& command) override;
  void Step(std::int64_t now_us) override;

  void SetFaults(const RobotSimFaults& faults) { faults_ = faults; }
  void SetBodyTemperature(double body_degc, bool warm);

  // What the virtual station draws: where the robot is between its last and its next view, 0..1.
  double progress() const;
  // Orders that were carried out, repetitions not counted.
  int executed() const { return executed_; }
  const RobotStatus& status() const { return status_; }

 private:
  void Execute(const RobotCommand& command);
  bool MayGo(std::uint16_t view) const;
  void StartMove(RobotState goal);
  void Advance();
  void Fault();
  void Report(bool because_changed);

  RobotSimConfig config_;
  RobotSimFaults faults_;
  RobotStatus status_;
  RobotStatus reported_;
  RobotState goal_ = RobotState::kHome;
  int last_view_ = -1;  // of this run along the path; -1 = at home
  bool has_seq_ = false;
  bool started_ = false;
  int executed_ = 0;
  std::int64_t now_us_ = 0;
  std::int64_t move_start_us_ = 0;
  std::int64_t in_position_us_ = 0;
  std::int64_t next_report_us_ = 0;
};

}  // namespace forgescan
