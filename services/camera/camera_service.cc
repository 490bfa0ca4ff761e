#include "services/camera/camera_service.h"

#include <fmt/format.h>

#include <cstdlib>

#include "services/common/bus/channels.h"

namespace forgescan {
namespace {

constexpr std::int64_t kTimerUs = 20'000;
constexpr std::size_t kExposuresKept = 1024;
constexpr std::int64_t kExposureRounding_us = 20;  // cameras round to their line time

std::int64_t ToUs(double seconds) { return static_cast<std::int64_t>(seconds * 1e6); }

// Differs between neighbouring views and attempts.
std::int64_t ViewKey(const fsmsg::exposure_t& exposure) {
  return (std::int64_t{exposure.part} * 1000 + exposure.view) * 1000 + exposure.attempt;
}

const char* Describe(PairingVerdict verdict) {
  switch (verdict) {
    case PairingVerdict::kMissing:
      return "brought no image in time";
    case PairingVerdict::kIncomplete:
      return "brought an image with holes";
    default:
      return "has an image whose number and time contradict each other";
  }
}

}  // namespace

CameraService::CameraService(StreamHub& hub, ServiceMonitor& monitor, Camera& camera, CameraConfig config,
                             std::int8_t side)
    : hub_(hub),
      monitor_(monitor),
      camera_(camera),
      config_(std::move(config)),
      side_(side),
      frame_channel_(side == fsmsg::exposure_t::CAMERA_LEFT ? kFrameLeft : kFrameRight),
      manifest_channel_(side == fsmsg::exposure_t::CAMERA_LEFT ? kViewFramesLeft : kViewFramesRight),
      pairing_(config_.pairing),
      book_(side) {
  hub_.Advertise(frame_channel_);
  hub_.Advertise(manifest_channel_);
  hub_.Subscribe<fsmsg::exposure_t>(kExposure, [this](const auto& exposure) { OnExposure(exposure); });
  hub_.Subscribe<fsmsg::view_captured_t>(kViewCaptured,
                                         [this](const auto& captured) { OnCaptured(captured); });
  camera_.SetHandler([this](CameraFrame frame) { OnFrame(std::move(frame)); });
  camera_.SetLostHandler([this](const Error& error) {
    monitor_.ReportError(error);
    hub_.bus().At(hub_.bus().NowUs(), [this] { StartCamera(); });  // not legal inside the handler
  });
  timer_ = hub_.bus().Every(kTimerUs, [this] {
    Carry(pairing_.AdvanceTo(hub_.bus().NowUs()));
    CountCamera();
  });
  StartCamera();
}

CameraService::~CameraService() {
  hub_.bus().Cancel(timer_);
  camera_.Stop();
}

void CameraService::StartCamera() {
  const Status started = camera_.Start();
  if (started.ok()) {
    Carry(pairing_.OnCameraStarted());
    monitor_.SetState(ServiceState::kReady, fmt::format("armed at {}", config_.address));
    return;
  }
  monitor_.ReportError(started.error());
  monitor_.SetState(ServiceState::kDegraded, fmt::format("looking for the camera at {}", config_.address));
  hub_.bus().At(hub_.bus().NowUs() + ToUs(config_.reconnect_s), [this] { StartCamera(); });
}

void CameraService::OnExposure(const fsmsg::exposure_t& exposure) {
  if (exposure.camera != side_) {
    return;
  }
  const std::uint64_t record = next_record_++;
  exposures_.emplace(record, exposure);
  while (exposures_.size() > kExposuresKept) {
    exposures_.erase(exposures_.begin());
  }
  const std::int64_t deadline_us = hub_.bus().NowUs() + ToUs(config_.frame_deadline_s);
  Carry(pairing_.OnPulse({.view_key = ViewKey(exposure),
                          .pulse = exposure.pulse,
                          .device_time_us = exposure.device_time_us,
                          .deadline_us = deadline_us,
                          .fired_us = exposure.utime,
                          .record = record}));
}

void CameraService::OnCaptured(const fsmsg::view_captured_t& captured) {
  book_.OnCaptured(captured);
  hub_.bus().At(hub_.bus().NowUs() + ToUs(config_.view_timeout_s), [this, key = ViewBook::KeyOf(captured)] {
    book_.Expire(key);
    PublishClosedViews();
  });
  PublishClosedViews();
}

void CameraService::OnFrame(CameraFrame frame) {
  const std::uint64_t handle = next_handle_++;
  const FrameRecord record{handle, frame.frame_id, frame.device_time_us, frame.complete, hub_.bus().NowUs()};
  frames_.emplace(handle, std::move(frame));
  Carry(pairing_.OnFrame(record));
}

void CameraService::Carry(const std::vector<PairingAction>& actions) {
  for (const PairingAction& action : actions) {
    CarryOne(action);
    if (action.handle.has_value()) {
      frames_.erase(*action.handle);
    }
  }
  if (!actions.empty()) {
    PublishClosedViews();
  }
}

void CameraService::CarryOne(const PairingAction& action) {
  if (action.verdict == PairingVerdict::kStray) {
    return monitor_.Count("frames_stray");
  }
  const auto found = exposures_.find(action.record);
  if (found == exposures_.end()) {
    return monitor_.ReportError(
        Fail(ErrorCode::kProtocol, "pulse {} was paired, but its record is gone", action.pulse));
  }
  const fsmsg::exposure_t& exposure = found->second;
  switch (action.verdict) {
    case PairingVerdict::kPaired:
      return PublishFrame(exposure, frames_.at(*action.handle));
    case PairingVerdict::kDuplicate:
      monitor_.Count("frames_duplicate");
      return book_.OnDuplicate(exposure);
    case PairingVerdict::kLate:
      monitor_.Count("frames_late");
      return book_.OnLate(exposure);
    default:
      return GiveUp(exposure, Describe(action.verdict));
  }
}

void CameraService::GiveUp(const fsmsg::exposure_t& exposure, const std::string& what) {
  const Error lost = Fail(ErrorCode::kUntrusted, "part {} view {}: pulse {} (pattern {}) {}", exposure.part,
                          exposure.view, exposure.pulse, exposure.pattern, what);
  monitor_.Count("frames_missing");
  monitor_.ReportError(lost);
  book_.OnMissing(exposure, lost.message);
}

std::string CameraService::WrongExposure(const fsmsg::exposure_t& exposure, const CameraFrame& frame) const {
  if (exposure.exposure_us != config_.exposure_us) {
    return fmt::format(
        "was ordered with {} us of exposure ([trigger]), the camera is set to {} us ([camera])",
        exposure.exposure_us, config_.exposure_us);
  }
  if (std::abs(frame.exposure_us - exposure.exposure_us) > kExposureRounding_us) {
    return fmt::format("was exposed for {} us instead of {} us", frame.exposure_us, exposure.exposure_us);
  }
  return {};
}

void CameraService::PublishFrame(const fsmsg::exposure_t& exposure, const CameraFrame& frame) {
  if (const std::string wrong = WrongExposure(exposure, frame); !wrong.empty()) {
    return GiveUp(exposure, wrong);
  }
  fsmsg::frame_t message{};
  message.utime = exposure.utime;
  message.part = exposure.part;
  message.view = exposure.view;
  message.attempt = exposure.attempt;
  message.camera = side_;
  message.pattern = exposure.pattern;
  message.pulse = exposure.pulse;
  message.frame_id = static_cast<std::int64_t>(frame.frame_id);
  message.device_time_us = frame.device_time_us;
  message.exposure_us = static_cast<std::int32_t>(frame.exposure_us);
  message.width_px = frame.width_px;
  message.height_px = frame.height_px;
  message.size = static_cast<std::int32_t>(frame.pixels.size());
  message.data = frame.pixels;
  const Status sent = hub_.Publish(frame_channel_, message);
  if (!sent.ok()) {
    monitor_.ReportError(sent.error());
    return book_.OnMissing(exposure, sent.error().message);
  }
  monitor_.Count("frames_sent");
  book_.OnSent(exposure);
}

void CameraService::PublishClosedViews() {
  for (const auto& manifest : book_.TakeClosed()) {
    if (const Status sent = hub_.Publish(manifest_channel_, manifest); !sent.ok()) {
      monitor_.ReportError(sent.error());
    }
    if (camera_.state() == Camera::State::kStreaming) {
      monitor_.SetState(ServiceState::kReady,
                        fmt::format("part {} view {}: {} of {} frames", manifest.part, manifest.view,
                                    manifest.frames_sent, manifest.frames_expected));
    }
  }
}

void CameraService::CountCamera() {
  const CameraCounters counters = camera_.counters();
  monitor_.SetCounter("packets_resent", static_cast<std::int64_t>(counters.packets_resent));
  monitor_.SetCounter("packets_missing", static_cast<std::int64_t>(counters.packets_missing));
  monitor_.SetCounter("frames_incomplete", static_cast<std::int64_t>(counters.frames_incomplete));
  monitor_.SetCounter("frames_overflowed", static_cast<std::int64_t>(counters.frames_overflowed));
  monitor_.SetCounter("devices_lost", static_cast<std::int64_t>(counters.devices_lost));
}

}  // namespace forgescan
