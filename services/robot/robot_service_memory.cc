// What the robot service does by its memory of the last parts: after a start, and with a verdict.
#include "services/robot/robot_service.h"

namespace forgescan {
namespace {

// A part that arrived longer ago has left the cell, whatever its number.
constexpr std::int64_t kInCellAtMost_us = 600'000'000;

// Why a verdict does not sort a part; empty if it does.
std::string WhyNotSorted(const fsmsg::verdict_t& verdict, const RememberedPart& part, std::int64_t now_us) {
  if (verdict.utime < part.arrived_us) {
    return fmt::format("a verdict on part {} is of an earlier part with this number: not sorted by it",
                       verdict.part);
  }
  if (now_us - part.arrived_us > kInCellAtMost_us) {
    return fmt::format("a verdict on part {} came {} s after the part, {} s are allowed: not sorted by it",
                       verdict.part, (now_us - part.arrived_us) / 1'000'000, kInCellAtMost_us / 1'000'000);
  }
  return "";
}

}  // namespace

void RobotService::Resume() {
  Note(memory_.Recall());
  const auto last = memory_.Last();
  if (!last.has_value() || Now() - last->second.arrived_us > kInCellAtMost_us) {
    return;
  }
  const auto& [part, remembered] = *last;
  machine_.Remember(part);
  if (!remembered.scanned) {
    Do(ScanFinished{Now(), remembered.arrived_us, part, remembered.views, remembered.captured,
                    "the robot service was started again during the scan"});
  }
}

void RobotService::OnVerdict(const fsmsg::verdict_t& verdict) {
  const bool known = verdict.verdict > fsmsg::verdict_t::VERDICT_UNKNOWN &&
                     verdict.verdict <= fsmsg::verdict_t::VERDICT_NOT_INSPECTED && verdict.part > 0;
  if (!known) {
    monitor_.ReportError(Fail(ErrorCode::kInvalidArgument,
                              "verdict {} of part {} is none: the part is not sorted", verdict.verdict,
                              verdict.part));
    return;
  }
  if (RememberedPart* part = memory_.Find(verdict.part)) {
    if (const std::string why_not = WhyNotSorted(verdict, *part, Now()); !why_not.empty()) {
      monitor_.ReportError(Fail(ErrorCode::kInvalidArgument, "{}", why_not));
      return;
    }
    if (part->asked || part->sorted) {
      monitor_.Count("verdicts_repeated");  // said again, in case this service had missed it
      return;
    }
    part->asked = true;
  }
  DoSort(sorter_.OnVerdict(static_cast<std::uint32_t>(verdict.part),
                           static_cast<LineVerdict>(verdict.verdict), Now()));
}

}  // namespace forgescan
