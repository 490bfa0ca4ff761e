// One part at a time along the taught path. Pure: events with their time in, actions out.
//
//   offline --link up, first status--> homing --home--> ready --part in place--> selecting --echo-->
//   approaching approaching --in position and settled--> capturing --captured--> approaching (next view) ...
//   --last--> homing approaching, capturing, selecting: fault, interlock, part gone, timeout -> scan aborted,
//   homing (or fault) fault --controller clear of its fault--> homing any: link lost -> scan aborted, offline
#pragma once

#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "drivers/line/line.h"
#include "drivers/robot/robot.h"
#include "services/robot/robot_config.h"

namespace forgescan {

enum class RobotPhase { kOffline, kReady, kSelecting, kApproaching, kCapturing, kHoming, kFault };

struct PartStarted {
  std::int64_t utime = 0;  // part in place
  std::int32_t part = 0;
  std::int32_t view_count = 0;
  std::uint32_t path_crc32 = 0;
};
struct ViewSettled {
  std::int64_t utime = 0;
  std::int32_t part = 0;
  std::int32_t view = 0;
  std::int32_t attempt = 0;
  double settled_ms = 0;
  double body_degc = 0;
};
struct ScanFinished {
  std::int64_t utime = 0;
  std::int64_t start_utime = 0;
  std::int32_t part = 0;
  std::int32_t views_expected = 0;
  std::int32_t views_captured = 0;
  std::string reason;  // empty: all views were captured
};
struct ViewTemperature {
  std::int64_t utime = 0;
  std::int32_t part = 0;
  std::int32_t view = 0;
  std::vector<double> readings_degc;  // while the robot stood at the view
};
struct RobotNote {
  std::string text;  // an event that does not belong into the present phase, or a fault worth showing
};
using RobotAction =
    std::variant<RobotCommand, PartStarted, ViewSettled, ScanFinished, ViewTemperature, RobotNote>;

// What the trigger said of a view.
struct CaptureReport {
  std::int64_t utime = 0;
  std::int32_t part = 0;
  std::int32_t view = 0;
  std::int32_t attempt = 0;
  bool captured = false;
  std::string reason;
};

class RobotMachine {
 public:
  using Actions = std::vector<RobotAction>;

  explicit RobotMachine(const RobotConfig& config) : config_(config) {}

  RobotPhase phase() const { return phase_; }
  std::int32_t part() const { return scanning() ? part_ : 0; }
  std::int32_t view() const { return view_; }
  std::int32_t captured() const { return captured_; }  // views of the part, so far
  std::string Text() const;                            // what it is doing, one line

  // Before the first event: this part was taken up by the service before this one, and is not again while it
  // stays in place.
  void Remember(std::int32_t part) { last_part_ = part; }
  // Ends the scan that is under way, as the service stops.
  Actions OnStop(std::int64_t now_us);
  Actions OnLink(bool up, std::int64_t now_us);
  Actions OnPath(const RobotPath& path);
  Actions OnStatus(const RobotStatus& status);
  Actions OnMotion(const RobotMotion& motion);
  Actions OnFault(const DeviceFault& fault, std::int64_t now_us);
  Actions OnPart(const LinePart& part, std::int64_t now_us);
  Actions OnLineLink(bool up, std::int64_t now_us);
  Actions OnPyrometer(const LinePyrometer& reading);
  Actions OnCapture(const CaptureReport& report,
                    std::int64_t now_us);  // illegal unless capturing that view and attempt
  Actions OnInterlock(bool stop, const std::string& reason, std::int64_t now_us);
  // Why the next part must not be begun, though one in work may be finished; empty = it may.
  void HoldNextPart(std::string reason) { hold_reason_ = std::move(reason); }
  Actions OnTick(std::int64_t now_us);

 private:
  bool scanning() const {
    return phase_ == RobotPhase::kSelecting || phase_ == RobotPhase::kApproaching ||
           phase_ == RobotPhase::kCapturing;
  }
  bool Echoed(const RobotStatus& status) const;
  std::string WhyNot() const;
  Actions Start(std::int64_t now_us);
  // A part that leaves without having been taken up still gets its story: started, and aborted with the
  // reason.
  Actions PassBy(std::int64_t now_us);
  bool HasNumber() const;  // the part in place, one that messages can carry
  Actions Order(RobotOrder order, std::int64_t now_us);
  Actions Abort(const std::string& reason, std::int64_t now_us);
  Actions GoHome(std::int64_t now_us);
  Actions Approach(std::int64_t now_us);
  Actions NextView(std::int64_t now_us);
  Actions Settle(const RobotStatus& status);
  ViewTemperature TakeTemperature(std::int64_t now_us);

  RobotConfig config_;
  RobotPhase phase_ = RobotPhase::kOffline;
  std::optional<RobotPath> path_;
  std::optional<RobotStatus> status_;
  double body_degc_ = 0;
  LinePart line_part_;
  // The part in place, once it was taken up or told of, so that none is scanned twice; until it leaves.
  std::optional<std::int32_t> last_part_;
  bool stop_ = false;
  std::string stop_reason_;
  std::string hold_reason_;

  RobotCommand order_;
  bool echoed_ = false;
  int sent_ = 0;
  std::int64_t echo_deadline_us_ = 0;
  std::int64_t deadline_us_ = 0;

  std::int32_t part_ = 0;
  std::int64_t start_us_ = 0;
  std::int32_t view_ = 0;
  std::int32_t attempt_ = 0;
  std::int32_t captured_ = 0;
  std::string void_reason_;
  std::optional<std::int64_t> in_position_since_us_;
  std::vector<double> readings_degc_;
};

void Append(RobotMachine::Actions& actions, RobotMachine::Actions more);

}  // namespace forgescan
