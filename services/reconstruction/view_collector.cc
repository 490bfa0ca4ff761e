#include "services/reconstruction/view_collector.h"

#include <fmt/format.h>

#include <algorithm>

namespace forgescan {

bool ViewCollector::IsCurrent(int attempt, std::int64_t utime) {
  if (attempt > attempt_) {
    *this = ViewCollector(frames_per_camera_);
    attempt_ = attempt;
  }
  if (attempt == attempt_) {
    newest_utime_ = std::max(newest_utime_, utime);
  }
  return attempt == attempt_;
}

ViewCollector::Camera* ViewCollector::CameraOf(int camera) {
  const bool known = camera == fsmsg::exposure_t::CAMERA_LEFT || camera == fsmsg::exposure_t::CAMERA_RIGHT;
  return known ? &cameras_[static_cast<std::size_t>(camera - fsmsg::exposure_t::CAMERA_LEFT)] : nullptr;
}

void ViewCollector::SetVoid(const std::string& reason) {
  if (void_reason_.empty()) {
    void_reason_ = reason;
  }
}

void ViewCollector::CheckPatterns(int fired) {
  if (fired != frames_per_camera_) {
    SetVoid(
        fmt::format("the trigger fires {} patterns a view ([trigger] patterns), pattern.toml lists {} frames",
                    fired, frames_per_camera_));
  }
}

void ViewCollector::OnCaptured(const fsmsg::view_captured_t& captured) {
  if (!IsCurrent(captured.attempt, captured.utime)) {
    return;
  }
  captured_utime_ = captured.utime;
  if (captured.status != fsmsg::view_captured_t::STATUS_CAPTURED) {
    SetVoid(captured.reason.empty() ? "the capture is void" : captured.reason);
  } else {
    CheckPatterns(captured.pulses_expected);
  }
}

void ViewCollector::OnManifest(const fsmsg::view_frames_t& manifest) {
  Camera* camera = CameraOf(manifest.camera);
  if (camera == nullptr || !IsCurrent(manifest.attempt, manifest.utime)) {
    return;
  }
  camera->manifest = manifest;
  CheckPatterns(manifest.frames_expected);
  if (manifest.frames_missing > 0) {
    SetVoid(manifest.reason.empty() ? "frames are missing" : manifest.reason);
  } else if (manifest.frames_sent != frames_per_camera_) {
    SetVoid(fmt::format("a camera sent {} frames, the sequence has {}", manifest.frames_sent,
                        frames_per_camera_));
  }
}

void ViewCollector::OnFrame(const fsmsg::frame_t& frame) {
  Camera* camera = CameraOf(frame.camera);
  if (camera == nullptr || !IsCurrent(frame.attempt, frame.utime)) {
    return;
  }
  const bool shaped = frame.width_px > 0 && frame.height_px > 0 &&
                      frame.data.size() == static_cast<std::size_t>(frame.width_px) *
                                               static_cast<std::size_t>(frame.height_px);
  if (!shaped || frame.pattern < 0 || frame.pattern >= frames_per_camera_) {
    return SetVoid(fmt::format("a frame of pattern {} has {} bytes for {} x {} pixels; patterns are 0 to {}",
                               frame.pattern, frame.data.size(), frame.width_px, frame.height_px,
                               frames_per_camera_ - 1));
  }
  camera->frames[frame.pattern] = frame;
}

void ViewCollector::Expire(const std::string& reason) {
  if (state() == State::kCollecting) {
    SetVoid(reason);
  }
}

ViewCollector::State ViewCollector::state() const {
  if (!void_reason_.empty()) {
    return State::kVoid;
  }
  const bool complete = std::all_of(cameras_.begin(), cameras_.end(), [this](const Camera& camera) {
    return camera.manifest.has_value() && static_cast<int>(camera.frames.size()) == frames_per_camera_;
  });
  return complete ? State::kComplete : State::kCollecting;
}

int ViewCollector::frames_received() const {
  return static_cast<int>(cameras_[0].frames.size() + cameras_[1].frames.size());
}

std::int64_t ViewCollector::middle_utime() const {
  std::int64_t first = 0, last = 0;
  for (const Camera& camera : cameras_) {
    for (const auto& [pattern, frame] : camera.frames) {
      first = first == 0 ? frame.utime : std::min(first, frame.utime);
      last = std::max(last, frame.utime);
    }
  }
  return last == 0 ? newest_utime_ : first + (last - first) / 2;
}

std::vector<const fsmsg::frame_t*> ViewCollector::Frames(int camera) const {
  std::vector<const fsmsg::frame_t*> frames;
  for (const auto& [pattern, frame] :
       cameras_[static_cast<std::size_t>(camera - fsmsg::exposure_t::CAMERA_LEFT)].frames) {
    frames.push_back(&frame);
  }
  return frames;
}

}  // namespace forgescan
