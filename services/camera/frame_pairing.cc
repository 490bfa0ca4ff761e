#include "services/camera/frame_pairing.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>

namespace forgescan {
namespace {

constexpr std::uint64_t kIds = 65535;  // 1..65535

// Steps from one id to a later one, 0..65534; from 0 (before the first) to id n it is n.
std::int64_t IdStep(std::uint64_t from, std::uint64_t to) {
  return static_cast<std::int64_t>(from == 0 ? to : (to + kIds - from) % kIds);
}

PairingAction Stray(const FrameRecord& frame) { return {PairingVerdict::kStray, 0, frame.handle, 0}; }

PairingAction Missing(const PulseRecord& pulse) {
  return {PairingVerdict::kMissing, pulse.pulse, std::nullopt, pulse.record};
}

}  // namespace

Status FramePairingOptions::Check() const {
  if (tolerance_us < 0 || max_window_us < tolerance_us || patience_us < 0 || memory_pulses < 1 ||
      !(drift_ppm >= 0 && drift_ppm <= 10'000)) {
    return Fail(
        ErrorCode::kInvalidArgument,
        "frame pairing: tolerance {} us, window {} us, patience {} us, memory {} pulses, drift {} ppm; needs "
        "0 <= tolerance <= window, patience >= 0, memory >= 1 and a drift of 0..10000 ppm",
        tolerance_us, max_window_us, patience_us, memory_pulses, drift_ppm);
  }
  return {};
}

std::vector<PairingAction> FramePairing::OnPulse(const PulseRecord& record) {
  std::vector<PairingAction> actions;
  if (!pulses_.empty() && (record.pulse <= pulses_.back().record.pulse ||
                           record.device_time_us <= pulses_.back().record.device_time_us)) {
    ForgetPulses(actions);  // the controller was started again, or its link: it counts from the beginning
  }
  if (view_key_ != record.view_key) {
    BeginView(record, actions);
  }
  pulses_.push_back({record, PulseState::kOpen});
  while (pulses_.size() > options_.memory_pulses && pulses_.front().state != PulseState::kOpen) {
    pulses_.pop_front();
  }
  const auto paired = TryWaiting();
  actions.insert(actions.end(), paired.begin(), paired.end());
  return actions;
}

std::vector<PairingAction> FramePairing::OnFrame(const FrameRecord& frame) {
  waiting_.push_back(frame);
  return TryWaiting();
}

std::vector<PairingAction> FramePairing::AdvanceTo(std::int64_t now_us) {
  std::vector<PairingAction> actions;
  for (Pulse& pulse : pulses_) {
    if (pulse.state == PulseState::kOpen && pulse.record.deadline_us <= now_us) {
      pulse.state = PulseState::kGivenUp;
      actions.push_back(Missing(pulse.record));
    }
  }
  std::erase_if(waiting_, [&](const FrameRecord& frame) {
    const bool expired = frame.arrived_us + options_.patience_us <= now_us;
    if (expired) {
      NoteId(frame.frame_id);
      actions.push_back(Stray(frame));
    }
    return expired;
  });
  return actions;
}

std::vector<PairingAction> FramePairing::OnCameraStarted() {
  std::vector<PairingAction> actions;
  for (const FrameRecord& frame : waiting_) {
    actions.push_back(Stray(frame));
  }
  waiting_.clear();
  anchor_.reset();
  view_key_.reset();  // what follows counts as a new view
  last_id_ = 0;
  last_view_had_gaps_ = false;
  return actions;
}

void FramePairing::ForgetPulses(std::vector<PairingAction>& actions) {
  for (const Pulse& pulse : pulses_) {
    if (pulse.state == PulseState::kOpen) {
      actions.push_back(Missing(pulse.record));
    }
  }
  pulses_.clear();
  anchor_.reset();
  view_key_.reset();
  last_view_had_gaps_ = false;
}

void FramePairing::BeginView(const PulseRecord& first, std::vector<PairingAction>& actions) {
  if (anchor_ && view_key_) {
    JudgeAnchor(first);
  }
  // Records come in order: a frame from before this view that still waits has lost its pulse.
  std::erase_if(waiting_, [&](const FrameRecord& frame) {
    const bool older = frame.arrived_us < first.fired_us - options_.fired_error_us;
    if (older) {
      NoteId(frame.frame_id);
      actions.push_back(Stray(frame));
    }
    return older;
  });
  view_key_ = first.view_key;
  view_first_pulse_ = first.pulse;
  id_before_view_ = last_id_;
}

// At the end of a view: is the learnt offset still to be believed?
void FramePairing::JudgeAnchor(const PulseRecord& first) {
  bool has_gaps = false, has_frames = false;
  for (auto pulse = pulses_.rbegin(); pulse != pulses_.rend() && pulse->record.view_key == view_key_;
       ++pulse) {
    const bool paired = pulse->state == PulseState::kPaired;
    has_frames = has_frames || paired;
    has_gaps = has_gaps || !paired;  // one that is still open has not shown that the guess was right
  }
  const bool believed = !has_gaps || (anchor_->confirmed && has_frames && !last_view_had_gaps_);
  last_view_had_gaps_ = has_gaps;
  if (!believed || WindowUs(first) > options_.max_window_us) {
    anchor_.reset();
    last_view_had_gaps_ = false;
  } else {
    anchor_->confirmed = true;
  }
}

std::vector<PairingAction> FramePairing::TryWaiting() {
  std::vector<PairingAction> actions;
  std::erase_if(waiting_, [&](const FrameRecord& frame) {
    const auto action = Try(frame);
    if (action) {
      actions.push_back(*action);
    }
    return action.has_value();
  });
  return actions;
}

// Nothing if the frame's pulse is not known yet.
std::optional<PairingAction> FramePairing::Try(const FrameRecord& frame) {
  if (frame.frame_id == 0 || frame.frame_id > kIds) {
    return Stray(frame);  // without id and time nothing can be said
  }
  Pulse* pulse = anchor_ ? FindByTime(frame) : FindById(frame);
  if (pulse == nullptr) {
    return std::nullopt;
  }
  return Assign(*pulse, frame);
}

// How far the frame of a pulse may be from where the offset puts it.
std::int64_t FramePairing::WindowUs(const PulseRecord& pulse) const {
  const std::int64_t elapsed_us = std::abs(pulse.device_time_us - anchor_->pulse.device_time_us);
  return options_.tolerance_us + std::llround(options_.drift_ppm * 1e-6 * static_cast<double>(elapsed_us));
}

FramePairing::Pulse* FramePairing::FindByTime(const FrameRecord& frame) {
  Pulse* best = nullptr;
  std::int64_t best_us = 0;
  for (Pulse& pulse : pulses_) {
    const std::int64_t window_us = std::min(WindowUs(pulse.record), options_.max_window_us);
    const std::int64_t error_us =
        std::abs(frame.device_time_us - pulse.record.device_time_us - anchor_->offset_us);
    if (error_us <= window_us && (best == nullptr || error_us < best_us)) {
      best = &pulse;
      best_us = error_us;
    }
  }
  return best;
}

// The first frame of a camera or after a view with gaps: the n-th id since the view before is the n-th pulse.
FramePairing::Pulse* FramePairing::FindById(const FrameRecord& frame) {
  if (!view_key_) {
    return nullptr;
  }
  const std::int64_t wanted = view_first_pulse_ + IdStep(id_before_view_, frame.frame_id) - 1;
  const auto found = std::find_if(pulses_.begin(), pulses_.end(),
                                  [&](const Pulse& pulse) { return pulse.record.pulse == wanted; });
  return found == pulses_.end() ? nullptr : &*found;
}

// A late frame does not count back.
void FramePairing::NoteId(std::uint64_t id) {
  const bool known = id >= 1 && id <= kIds;
  if (known && IdStep(last_id_, id) <= static_cast<std::int64_t>(kIds / 2)) {
    last_id_ = id;
  }
}

PairingAction FramePairing::Assign(Pulse& pulse, const FrameRecord& frame) {
  const auto gets = [&](PairingVerdict verdict) {
    return PairingAction{verdict, pulse.record.pulse, frame.handle, pulse.record.record};
  };
  if (pulse.state == PulseState::kPaired) {
    return gets(PairingVerdict::kDuplicate);
  }
  NoteId(frame.frame_id);
  if (pulse.state == PulseState::kGivenUp) {
    return gets(PairingVerdict::kLate);
  }
  if (!IdAgrees(pulse, frame)) {
    pulse.state = PulseState::kGivenUp;
    return gets(PairingVerdict::kContradiction);
  }
  const bool confirmed = anchor_ && anchor_->confirmed;
  anchor_ =
      Anchor{frame.device_time_us - pulse.record.device_time_us, pulse.record, frame.frame_id, confirmed};
  pulse.state = frame.complete ? PulseState::kPaired : PulseState::kGivenUp;
  return gets(frame.complete ? PairingVerdict::kPaired : PairingVerdict::kIncomplete);
}

// Later pulses have later ids, and the camera cannot have exposed more edges than there were pulses.
bool FramePairing::IdAgrees(const Pulse& pulse, const FrameRecord& frame) const {
  if (!anchor_) {
    return true;
  }
  const std::int64_t pulse_step = pulse.record.pulse - anchor_->pulse.pulse;
  const std::int64_t id_step =
      pulse_step >= 0 ? IdStep(anchor_->frame_id, frame.frame_id) : IdStep(frame.frame_id, anchor_->frame_id);
  return id_step >= 1 && id_step <= std::abs(pulse_step);
}

}  // namespace forgescan
