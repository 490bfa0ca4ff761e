#include "services/robot/sort_machine.h"

#include <fmt/core.h>

namespace forgescan {
namespace {

constexpr std::int64_t kUsPerMs = 1000;

}  // namespace

SortMachine::Actions SortMachine::OnVerdict(std::uint32_t part, LineVerdict verdict, std::int64_t now_us) {
  waiting_.emplace_back(part, verdict);
  return phase_ == Phase::kIdle ? Begin(now_us) : Actions{};
}

SortMachine::Actions SortMachine::Begin(std::int64_t now_us) {
  if (waiting_.empty()) {
    return {};
  }
  command_ = {waiting_.front().first, waiting_.front().second, static_cast<std::uint16_t>(command_.seq + 1)};
  waiting_.pop_front();
  phase_ = Phase::kAsking;
  sent_ = 0;
  return {Command(now_us)};
}

LineCommand SortMachine::Command(std::int64_t now_us) {
  ++sent_;
  repeat_us_ = now_us + config_.sort_echo_timeout_ms * kUsPerMs;
  return command_;
}

SortMachine::Actions SortMachine::Finish(std::int64_t now_us, const std::string& reason) {
  phase_ = Phase::kIdle;
  Actions actions{PartSorted{now_us, command_.part, command_.verdict, reason.empty(), reason}};
  const Actions next = Begin(now_us);
  actions.insert(actions.end(), next.begin(), next.end());
  return actions;
}

// A wrong echo is no echo: the command is repeated, and the last word is that of the timeout.
SortMachine::Actions SortMachine::OnEcho(const LineSortEcho& echo) {
  const bool ours =
      echo.seq_echo == command_.seq && echo.part == command_.part && echo.verdict == command_.verdict;
  if (phase_ == Phase::kIdle || !ours) {
    return {};
  }
  if (phase_ == Phase::kAsking) {
    phase_ = Phase::kMoving;
    gate_until_us_ = echo.utime + static_cast<std::int64_t>(config_.gate_timeout_s * 1e6);
  }
  if (echo.gate == GateState::kDone) {
    return Finish(echo.utime, "");
  }
  return echo.gate == GateState::kStuck ? Finish(echo.utime, "the gate is stuck") : Actions{};
}

SortMachine::Actions SortMachine::OnTick(std::int64_t now_us) {
  if (phase_ == Phase::kMoving && now_us >= gate_until_us_) {
    return Finish(now_us, fmt::format("the gate was not done after {} s", config_.gate_timeout_s));
  }
  if (phase_ == Phase::kIdle || now_us < repeat_us_) {
    return {};
  }
  if (phase_ == Phase::kAsking && sent_ > config_.sort_resends) {
    return Finish(now_us, fmt::format("the line did not echo the sort command, sent {} times", sent_));
  }
  return {Command(now_us)};
}

}  // namespace forgescan
