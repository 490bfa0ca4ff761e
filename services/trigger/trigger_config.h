// Settings of the trigger service; the only home of their defaults.
#pragma once

#include "services/common/config/config.h"

namespace forgescan {

struct TriggerConfig {
  int exposure_us = 12'000;  // of each camera, a multiple of 10
  int patterns = 8;          // projector periods of a view
  int first_pattern = 0;
  int period_us = 0;                     // of the projector; 0: the shortest that fits
  int margin_us = 1'000;                 // of each half period, for readout and jitter
  std::int64_t frame_bytes = 5'013'504;  // 2448 x 2048, 8 bits
  double link_mbit_s = 1000;             // shared by both cameras
  double link_efficiency = 0.95;         // payload share with jumbo frames
  int echo_timeout_ms = 50;
  int resends = 2;
  int record_timeout_ms = 300;  // after the last pulse, for the records to come

  // Errors: kInvalidArgument, naming the field and its range.
  Status Check() const;
  // Reads the table [trigger].
  static Result<TriggerConfig> Load(ConfigTable table);
};

// When the pulses of a view fire. Each half period holds one camera's exposure and the other's transmission.
struct TriggerPlan {
  int period_us = 0;
  int transfer_us = 0;       // of one frame over the whole link
  std::int64_t view_us = 0;  // from the first pulse to the end of the last exposure
};

// Source: paper, section 2.1.2 (time-division multiplexing).
// Errors: kInvalidArgument when a period is asked for that is shorter than two halves of max(exposure,
// transfer) + margin.
Result<TriggerPlan> PlanTrigger(const TriggerConfig& config);

}  // namespace forgescan
