// What a report service started again does about the parts its forerunner had in work, and about verdicts the
// line may not have heard.
#include <algorithm>

#include "services/common/bus/channels.h"
#include "services/report/report_service.h"

namespace forgescan {
namespace {

// A part of longer ago has left the cell: nobody would know what to do with its verdict.
constexpr std::int64_t kInCellAtMostUs = 600'000'000;

}  // namespace

// A part of which nothing but its arrival was taken in goes on as if nothing had happened. What came of
// others is lost, so they end here.
void ReportService::Resume() {
  Note(kept_.Recall());
  std::map<int, KeptPart> open;
  kept_.ForEach([&](int part, const KeptPart& kept) {
    if (kept.verdict.has_value()) {
      const std::int64_t utime = kept.verdict->utime;
      std::optional<fsmsg::part_arrived_t> arrived;
      if (kept.arrived_utime.has_value()) {
        arrived = Arrival(part, *kept.arrived_utime);
      }
      finished_.Insert(part, {utime, utime + config_.part_timeout_us(), arrived});
    } else {
      open.emplace(part, kept);
    }
  });
  for (const auto& [part, kept] : open) {
    ResumePart(part, kept);
  }
}

fsmsg::part_arrived_t ReportService::Arrival(int part, std::int64_t utime) {
  fsmsg::part_arrived_t arrived{};
  arrived.utime = utime;
  arrived.part = part;
  return arrived;
}

void ReportService::ResumePart(int part, const KeptPart& kept) {
  PartInWork& work = OpenPart(part, kept.first_utime);
  if (kept.arrived_utime.has_value()) {
    work.arrived = Arrival(part, *kept.arrived_utime);
    Note(kept_.Arrived(part, *kept.arrived_utime));
  }
  const bool too_late = hub_.bus().NowUs() - kept.first_utime > config_.part_timeout_us();
  if (kept.results_came || too_late) {
    monitor_.Count("parts_lost_by_restart");
    work.stopped = "The report service was started again while the part was in work.";
    Finish(part);
    return;
  }
  // What was sent while no service listened is as good as given up.
  work.fusion_hole = work.cloud_hole = true;
  CheckLossesLater();
}

void ReportService::OnRobotState(const fsmsg::service_state_t& state) {
  const bool listens = state.state == fsmsg::service_state_t::STATE_READY ||
                       state.state == fsmsg::service_state_t::STATE_WORKING;
  if (state.name != "robot" || !listens || state.session == robot_session_) {
    return;
  }
  robot_session_ = state.session;
  const std::int64_t oldest_us = hub_.bus().NowUs() - kInCellAtMostUs;
  kept_.ForEach([&](int, const KeptPart& kept) {
    if (kept.verdict.has_value() && kept.first_utime > oldest_us) {
      monitor_.Count("verdicts_repeated");
      Note(hub_.Publish(kVerdict, *kept.verdict));
    }
  });
}

void ReportService::OnSorted(const fsmsg::part_sorted_t& message) {
  monitor_.Count(message.acknowledged != 0 ? "sorted" : "sort_failed");
  Note(kept_.Sorted(message.part));
  if (message.acknowledged == 0) {
    Note(Fail(ErrorCode::kUnavailable, "part {}: the line did not acknowledge the verdict: {}", message.part,
              message.reason));
  }
}

}  // namespace forgescan
