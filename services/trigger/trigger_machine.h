// The sequence of one view: command, echo, pulses, records, done or void. Pure: events with their time in,
// actions out.
//
//   offline --link up, first status--> idle --view ready--> arming --echo--> firing --all records--> idle
//   arming: no echo after the resends, firing: records missing at the deadline, position lost, interlock ->
//   void, idle any: link lost, device started again -> void if a view was under way, offline
#pragma once

#include <array>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "drivers/trigger/trigger.h"
#include "services/trigger/device_clock.h"
#include "services/trigger/trigger_config.h"

namespace forgescan {

enum class TriggerPhase { kOffline, kIdle, kArming, kFiring };

struct ViewRequest {
  std::int64_t utime = 0;
  std::int32_t part = 0;
  std::int32_t view = 0;
  std::int32_t attempt = 0;
};

struct ExposureRecord {
  ViewRequest view;
  std::int64_t utime = 0;  // start of the exposure, station time
  bool right = false;
  std::int32_t pattern = 0;
  std::int32_t pulse = 0;  // of this camera since the microcontroller started (counted on when it wraps)
  std::int64_t device_time_us = 0;
  std::int32_t exposure_us = 0;
};

struct ViewOutcome {
  ViewRequest view;
  std::int64_t utime = 0;  // end of the last exposure, or of giving up
  bool captured = false;
  std::int32_t pulses_expected = 0;      // of each camera
  std::array<std::int32_t, 2> pulses{};  // left, right: recorded
  std::string reason = {};               // empty when captured
};

// An event that does not belong into the present phase; counted and shown, otherwise without effect.
struct TriggerNote {
  std::string text;
};

using TriggerAction = std::variant<TriggerCommand, ExposureRecord, ViewOutcome, TriggerNote>;

class TriggerMachine {
 public:
  using Actions = std::vector<TriggerAction>;

  // The configuration must have passed Check().
  explicit TriggerMachine(const TriggerConfig& config);

  TriggerPhase phase() const { return phase_; }

  Actions OnLink(bool up, std::int64_t now_us);
  Actions OnViewReady(const ViewRequest& request,
                      std::int64_t now_us);                   // illegal unless idle: that view becomes void
  Actions OnPosition(bool in_position, std::int64_t now_us);  // false while a view is under way makes it void
  Actions OnInterlock(bool stop, const std::string& reason, std::int64_t now_us);
  Actions OnStatus(const TriggerStatus& status);
  Actions OnPulse(const TriggerPulse& pulse);  // illegal unless firing the command it belongs to
  Actions OnFault(const DeviceFault& fault, std::int64_t now_us);
  Actions OnTick(std::int64_t now_us);

 private:
  bool active() const { return phase_ == TriggerPhase::kArming || phase_ == TriggerPhase::kFiring; }
  TriggerCommand Command(TriggerMode mode) const;
  ViewOutcome Outcome(std::int64_t utime) const;
  // Clock and pulse numbers begin again with the next status.
  Actions Forget(const std::string& reason, std::int64_t now_us);
  Actions Void(const std::string& reason, std::int64_t now_us);
  void Accept(std::int64_t now_us);
  bool Complete() const;

  TriggerConfig config_;
  TriggerPlan plan_;
  TriggerPhase phase_ = TriggerPhase::kOffline;
  bool link_up_ = false;
  DeviceClock clock_;
  ViewRequest view_;
  std::uint16_t seq_ = 0;
  int sent_ = 0;
  std::int64_t deadline_us_ = 0;
  std::int64_t last_exposure_us_ = 0;
  std::array<std::uint32_t, 2> seen_{};        // bit per pattern
  std::array<std::int32_t, 2> pulse_count_{};  // unwrapped
  bool stop_ = false;
  std::string stop_reason_;
};

}  // namespace forgescan
