#include "services/common/service/step_timer.h"

namespace forgescan {

StepTimer::StepTimer(StreamHub& hub, std::string step, int part, int view)
    : hub_(hub), step_(std::move(step)), part_(part), view_(view), start_us_(hub.bus().NowUs()) {}

void StepTimer::Finish(const Channel<fsmsg::processing_time_t>& channel, ServiceMonitor& monitor,
                       std::int64_t utime) const {
  fsmsg::processing_time_t time{};
  time.utime = utime;
  time.step = step_;
  time.part = part_;
  time.view = view_;
  time.duration_us = hub_.bus().NowUs() - start_us_;
  if (const Status sent = hub_.Publish(channel, time); !sent.ok()) {
    monitor.ReportError(sent.error());
  }
}

}  // namespace forgescan
