// A trigger microcontroller in simulated time: its own drifting clock, the pulse pattern, and faults on
// request.
#pragma once

#include <deque>

#include "drivers/trigger/trigger.h"

namespace forgescan {

struct TriggerSimConfig {
  std::uint32_t device_time_at_start_us = 0;  // near 2^32 to see it wrap
  double drift_ppm = 0;                       // of its clock against the station's
};

struct TriggerSimFaults {
  int lose_pulse_of_view = -1;   // this pulse (0.. in the view) of the right camera is not fired
  int lose_record = -1;          // fired, but its record is not sent
  bool deaf = false;             // commands do not arrive
  bool repeats_records = false;  // every record is sent twice
};

class TriggerSim final : public Trigger {
 public:
  // An edge on a camera's trigger line: exposure starts at `utime`.
  struct Edge {
    bool right = false;
    std::uint16_t view = 0;
    std::uint8_t pattern = 0;
    std::int64_t utime = 0;
    std::uint16_t exposure_us = 0;
  };
  using EdgeHandler = std::function<void(const Edge&)>;

  explicit TriggerSim(const TriggerSimConfig& config = {}) : config_(config) {}

  Status Send(const TriggerCommand& command) override;
  void Step(std::int64_t now_us) override;

  // Called within Step at the first step at or after the edge, in order of time.
  void SetEdgeHandler(EdgeHandler handler) { edge_handler_ = std::move(handler); }
  void SetFaults(const TriggerSimFaults& faults) { faults_ = faults; }

 private:
  struct Planned {
    Edge edge;
    int index = 0;  // in the view
  };

  void Plan(const TriggerCommand& command);
  void Fire(const Planned& planned);
  void Report();
  std::uint32_t DeviceTime(std::int64_t utime) const;

  TriggerSimConfig config_;
  TriggerSimFaults faults_;
  EdgeHandler edge_handler_;
  TriggerStatus status_;
  bool started_ = false;
  bool has_seq_ = false;
  std::deque<Planned> planned_;
  std::deque<std::pair<std::int64_t, TriggerPulse>> records_;  // to be sent at the end of the exposure
  std::uint16_t fired_left_ = 0;
  std::uint16_t fired_right_ = 0;
  std::int64_t start_us_ = 0;
  std::int64_t now_us_ = 0;
  std::int64_t next_report_us_ = 0;
};

}  // namespace forgescan
