// FramePairing: decides which frame of ONE camera belongs to which pulse of the trigger controller; never by
// order of arrival.
//
// Two witnesses must agree. The camera numbers the edges it exposed (frame id, 65535 is followed by 1) and
// stamps them with its clock; the controller numbers the pulses it sent and stamps them with its own. The
// offset of the clocks is unknown, but apart from a bounded drift it is constant. It is learnt from the first
// frame of a view, which the frame id assigns to a pulse:
//
//   no anchor --frame, by id step since the view before--> anchor --view without a missing pulse--> confirmed
//   anchor
//       ^                                                    |                                          |
//       +------ next view, if a pulse of this one is missing +                                          |
//       +------ next view, if no pulse of this one has a frame, or if pulses were missing in two views  |
//       |       running, or if the pause before it was so long that drift makes time ambiguous ---------+
//       +------ at once, if pulse number or time of the controller go back: it was started again
//
// With an anchor only time assigns; the id must then step by at most as much as the pulse (less: edges the
// camera did not see). A first assignment that is off by k pulses leaves k pulses without a frame, so it
// voids its own view and is forgotten with it; no view is ever complete and wrong. A frame that arrived
// before a view's first pulse was fired never belongs to that view.
#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <optional>
#include <vector>

#include "services/common/result.h"

namespace forgescan {

struct FramePairingOptions {
  std::int64_t tolerance_us = 300;  // jitter of both stamps together
  double drift_ppm = 100;           // of the clocks against each other
  std::int64_t max_window_us =
      8000;  // a pause that lets the clocks drift further ends the offset; less than half the pulse period
  std::int64_t patience_us = 1'000'000;  // how long a frame waits for its exposure record
  std::size_t memory_pulses = 512;       // how far back late and duplicate frames are recognised
  std::int64_t fired_error_us =
      20'000;  // of PulseRecord::fired_us; less than exposure and wire time of a frame

  Status Check() const;
};

// One pulse. Units: us; deadline on the clock of AdvanceTo(), device time on the controller's.
struct PulseRecord {
  std::int64_t view_key = 0;  // any number that differs between neighbouring views (and attempts)
  std::int64_t pulse = 0;     // counted by the controller, +1 each
  std::int64_t device_time_us = 0;
  std::int64_t deadline_us = 0;  // after this the pulse has no frame
  std::int64_t fired_us = 0;     // on the clock of AdvanceTo(), not after the exposure's end; 0: not known
  std::uint64_t record = 0;      // the caller's name for the pulse; numbers begin again, this should not
};

struct FrameRecord {
  std::uint64_t handle = 0;         // the caller's name for the image
  std::uint64_t frame_id = 0;       // 1..65535; 0 = UNKNOWN
  std::int64_t device_time_us = 0;  // camera clock; meaningless if frame_id is 0
  bool complete = false;
  std::int64_t arrived_us = 0;  // on the clock of AdvanceTo()
};

enum class PairingVerdict {
  kPaired,         // publish the frame with this pulse
  kMissing,        // the pulse has no frame: its deadline passed
  kIncomplete,     // the pulse has no frame: it arrived with holes
  kContradiction,  // the pulse has no frame: time says this one, but the ids deny it
  kDuplicate,      // the pulse has a frame already
  kLate,           // the pulse was given up before
  kStray,          // a frame of no known pulse
};

// Every pulse gets exactly one of the first four, every frame exactly one verdict.
struct PairingAction {
  PairingVerdict verdict;
  std::int64_t pulse = 0;               // not for kStray
  std::optional<std::uint64_t> handle;  // not for kMissing
  std::uint64_t record = 0;             // of the pulse; not for kStray
};

// Pure: time comes in as an argument. Not thread-safe.
class FramePairing {
 public:
  explicit FramePairing(FramePairingOptions options) : options_(options) {}

  std::vector<PairingAction> OnPulse(const PulseRecord& record);
  std::vector<PairingAction> OnFrame(const FrameRecord& frame);
  std::vector<PairingAction> AdvanceTo(std::int64_t now_us);
  // The camera was started again: its ids begin at 1 and its clock may have jumped. Frames that waited are
  // stray.
  std::vector<PairingAction> OnCameraStarted();

  bool anchored() const { return anchor_.has_value(); }

 private:
  enum class PulseState { kOpen, kPaired, kGivenUp };
  struct Pulse {
    PulseRecord record;
    PulseState state = PulseState::kOpen;
  };
  struct Anchor {
    std::int64_t offset_us = 0;  // camera clock - controller clock, at the last pair
    PulseRecord pulse;           // of the last pair
    std::uint64_t frame_id = 0;  // of the last pair
    bool confirmed = false;
  };

  void ForgetPulses(std::vector<PairingAction>& actions);
  void BeginView(const PulseRecord& first, std::vector<PairingAction>& actions);
  void JudgeAnchor(const PulseRecord& first);
  std::int64_t WindowUs(const PulseRecord& pulse) const;
  std::vector<PairingAction> TryWaiting();
  std::optional<PairingAction> Try(const FrameRecord& frame);
  Pulse* FindByTime(const FrameRecord& frame);
  Pulse* FindById(const FrameRecord& frame);
  PairingAction Assign(Pulse& pulse, const FrameRecord& frame);
  void NoteId(std::uint64_t id);
  bool IdAgrees(const Pulse& pulse, const FrameRecord& frame) const;

  const FramePairingOptions options_;
  std::deque<Pulse> pulses_;
  std::deque<FrameRecord> waiting_;
  std::optional<Anchor> anchor_;
  std::optional<std::int64_t> view_key_;
  std::int64_t view_first_pulse_ = 0;
  std::uint64_t id_before_view_ = 0;  // the last id seen before this view; 0: none since the camera's start
  std::uint64_t last_id_ = 0;
  bool last_view_had_gaps_ = false;
};

}  // namespace forgescan
