// Measures a processing step and publishes how long it took. By the wall clock, and so kept out of every
// result.
#pragma once

#include <cstdint>
#include <string>

#include "fsmsg/processing_time_t.hpp"
#include "services/common/service/service_monitor.h"

namespace forgescan {

class StepTimer {
 public:
  // Begins now. `view`: index, or kAllViews (-1).
  StepTimer(StreamHub& hub, std::string step, int part, int view);
  // Publishes the time since the beginning; a refusal is reported to the monitor. utime: of the result of the
  // step, which tells the part from others with its number.
  void Finish(const Channel<fsmsg::processing_time_t>& channel, ServiceMonitor& monitor,
              std::int64_t utime) const;

 private:
  StreamHub& hub_;
  std::string step_;
  int part_;
  int view_;
  std::int64_t start_us_;
};

}  // namespace forgescan
