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
  if (view_key_ != record.view_key) {
    BeginView(record);
  }
  pulses_.push_back({record, PulseState::kOpen});
  while (pulses_.size() > options_.memory_pulses && pulses_.front().state != PulseState::kOpen) {
    pulses_.pop_front();
  }
  return TryWaiting();
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
      view_has_gaps_ = true;
      actions.push_back({PairingVerdict::kMissing, pulse.record.pulse, std::nullopt});
    }
  }
  std::erase_if(waiting_, [&](const FrameRecord& frame) {
    const bool expired = frame.arrived_us + options_.patience_us <= now_us;
    if (expired) {
      last_id_ = frame.frame_id;
      actions.push_back({PairingVerdict::kStray, 0, frame.handle});
    }
    return expired;
  });
  return actions;
}

void FramePairing::OnCameraStarted() {
  anchor_.reset();
  view_key_.reset();  // what follows counts as a new view
  last_id_ = 0;
  view_has_gaps_ = false;
}

void FramePairing::BeginView(const PulseRecord& first) {
  if (anchor_ && view_key_) {
    anchor_->confirmed = anchor_->confirmed || !view_has_gaps_;
    if (!anchor_->confirmed) {
      anchor_.reset();
    }
  }
  view_key_ = first.view_key;
  view_first_pulse_ = first.pulse;
  id_before_view_ = last_id_;
  view_has_gaps_ = false;
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
    return PairingAction{PairingVerdict::kStray, 0, frame.handle};  // without id and time nothing can be said
  }
  Pulse* pulse = anchor_ ? FindByTime(frame) : FindById(frame);
  if (pulse == nullptr) {
    return std::nullopt;
  }
  return Assign(*pulse, frame);
}

FramePairing::Pulse* FramePairing::FindByTime(const FrameRecord& frame) {
  Pulse* best = nullptr;
  std::int64_t best_us = 0;
  for (Pulse& pulse : pulses_) {
    const std::int64_t elapsed_us = std::abs(pulse.record.device_time_us - anchor_->pulse.device_time_us);
    const auto drift_us = std::llround(options_.drift_ppm * 1e-6 * static_cast<double>(elapsed_us));
    const std::int64_t window_us = options_.tolerance_us + drift_us;
    const std::int64_t error_us =
        std::abs(frame.device_time_us - pulse.record.device_time_us - anchor_->offset_us);
    if (error_us <= std::min(window_us, options_.max_window_us) && (best == nullptr || error_us < best_us)) {
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

PairingAction FramePairing::Assign(Pulse& pulse, const FrameRecord& frame) {
  const std::int64_t number = pulse.record.pulse;
  if (pulse.state == PulseState::kPaired) {
    return {PairingVerdict::kDuplicate, number, frame.handle};
  }
  if (pulse.state == PulseState::kGivenUp) {
    last_id_ = frame.frame_id;
    return {PairingVerdict::kLate, number, frame.handle};
  }
  const bool agrees = IdAgrees(pulse, frame);
  if (agrees) {
    last_id_ = frame.frame_id;
    const bool confirmed = anchor_ && anchor_->confirmed;
    anchor_ =
        Anchor{frame.device_time_us - pulse.record.device_time_us, pulse.record, frame.frame_id, confirmed};
  }
  const bool paired = agrees && frame.complete;
  pulse.state = paired ? PulseState::kPaired : PulseState::kGivenUp;
  view_has_gaps_ = view_has_gaps_ || !paired;
  if (paired) {
    return {PairingVerdict::kPaired, number, frame.handle};
  }
  return {agrees ? PairingVerdict::kIncomplete : PairingVerdict::kContradiction, number, frame.handle};
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
