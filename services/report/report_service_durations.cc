// How long the steps took that were spent on a part.
#include "services/report/report_service.h"

namespace forgescan {
namespace {

// A view that is being exposed when a scan is broken off is finished, and so is later than the scan's end.
constexpr std::int64_t kAfterScanUs = 10'000'000;

}  // namespace

void ReportService::OnDuration(const fsmsg::processing_time_t& message) {
  if (PartInWork* work = FindStep(message.part, message.utime); work != nullptr) {
    work->duration_us[message.step] += message.duration_us;
  }
}

PartInWork* ReportService::FindStep(int part, std::int64_t utime) {
  PartInWork* judged = pages_.Find(part);
  if (judged != nullptr && judged->Covers(utime)) {
    return judged;
  }
  const auto open = open_.find(part);
  const bool late = open == open_.end() ? IsLate(part, utime - kAfterScanUs)
                                        : utime > open->second.work.scan_end_utime.value_or(utime);
  return late ? nullptr : Find(part, utime);
}

}  // namespace forgescan
