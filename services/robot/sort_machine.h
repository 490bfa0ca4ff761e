// Tells the line where a part belongs and makes sure that it heard. Pure: events with their time in, actions
// out.
//
//   idle --verdict--> asking --echo of seq, part and verdict--> moving --gate done--> acknowledged, idle
//   asking: no or a wrong echo after the resends -> failed; moving: gate stuck or not done in time -> failed.
//   moving, the command is repeated too: the answer says how the gate stands, should that echo have been
//   lost.
#pragma once

#include <deque>
#include <string>
#include <variant>
#include <vector>

#include "drivers/line/line.h"
#include "services/robot/robot_config.h"

namespace forgescan {

struct PartSorted {
  std::int64_t utime = 0;
  std::uint32_t part = 0;
  LineVerdict verdict = LineVerdict::kUnknown;
  bool acknowledged = false;
  std::string reason;  // empty when acknowledged
};
using SortAction = std::variant<LineCommand, PartSorted>;

class SortMachine {
 public:
  using Actions = std::vector<SortAction>;

  explicit SortMachine(const RobotConfig& config) : config_(config) {}

  // Parts are sorted one after the other, in the order of their verdicts.
  Actions OnVerdict(std::uint32_t part, LineVerdict verdict, std::int64_t now_us);
  Actions OnEcho(const LineSortEcho& echo);
  Actions OnTick(std::int64_t now_us);

 private:
  enum class Phase { kIdle, kAsking, kMoving };

  Actions Begin(std::int64_t now_us);
  LineCommand Command(std::int64_t now_us);
  Actions Finish(std::int64_t now_us, const std::string& reason);

  RobotConfig config_;
  Phase phase_ = Phase::kIdle;
  LineCommand command_;
  int sent_ = 0;
  std::int64_t repeat_us_ = 0;  // the next time the command is repeated, or given up while asking
  std::int64_t gate_until_us_ = 0;
  std::deque<std::pair<std::uint32_t, LineVerdict>> waiting_;
};

}  // namespace forgescan
