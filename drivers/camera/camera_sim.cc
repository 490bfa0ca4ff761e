#include "drivers/camera/camera_sim.h"

#include <utility>

namespace forgescan {
namespace {

constexpr std::uint64_t kLastFrameId = 65535;  // GVSP block ids are 16 bit and skip 0

Status Check(const CameraSimOptions& options) {
  if (options.width_px < 1 || options.height_px < 1) {
    return Fail(ErrorCode::kInvalidArgument, "simulated camera: image of {} x {} px, must be at least 1 x 1",
                options.width_px, options.height_px);
  }
  if (options.first_frame_id < 1 || options.first_frame_id > kLastFrameId) {
    return Fail(ErrorCode::kInvalidArgument, "simulated camera: first frame id {} is outside 1..65535",
                options.first_frame_id);
  }
  return {};
}

}  // namespace

CameraSim::CameraSim(CameraSimOptions options)
    : QueuedCamera(options.queue_capacity_frames), options_(options), random_(options.seed) {}

Status CameraSim::Start() {
  RETURN_IF_ERROR(Check(options_));
  if (state_ == State::kStreaming) {
    return Fail(ErrorCode::kInvalidArgument, "simulated camera: Start() while streaming");
  }
  if (!present_ || !queue_.valid()) {
    return Fail(ErrorCode::kUnavailable, "simulated camera: the device does not answer");
  }
  session_ = queue_.Open();
  next_frame_id_ = options_.first_frame_id;
  state_ = State::kStreaming;
  return {};
}

void CameraSim::Stop() {
  late_discarded_ += late_ ? 1U : 0U;
  late_.reset();
  queue_.Close();
  state_ = State::kClosed;
}

CameraCounters CameraSim::counters() const {
  CameraCounters counters = queue_.counters();
  counters.frames_discarded += late_discarded_;
  counters.devices_lost = devices_lost_;
  counters.triggers_ignored = triggers_ignored_;
  return counters;
}

Status CameraSim::Trigger(std::int64_t device_time_us, std::vector<std::uint8_t> image) {
  const auto expected_bytes =
      static_cast<std::size_t>(options_.width_px) * static_cast<std::size_t>(options_.height_px);
  if (image.size() != expected_bytes) {
    return Fail(ErrorCode::kInvalidArgument, "simulated camera: image of {} bytes, must be {} x {} = {}",
                image.size(), options_.width_px, options_.height_px, expected_bytes);
  }
  if (state_ != State::kStreaming || !present_) {
    ++triggers_ignored_;
    return {};
  }
  // All five draws are made whatever their outcome, so that one fault's chance does not move the others.
  const bool lost_trigger = Happens(options_.faults.lost_trigger_chance);
  const bool lost_frame = Happens(options_.faults.lost_frame_chance);
  const bool incomplete = Happens(options_.faults.incomplete_chance);
  const bool duplicate = Happens(options_.faults.duplicate_chance);
  const bool late = Happens(options_.faults.late_chance);
  if (lost_trigger) {
    return {};
  }
  const std::uint64_t frame_id = TakeFrameId();
  if (lost_frame) {
    return {};
  }
  CameraFrame frame{options_.width_px,
                    options_.height_px,
                    std::move(image),
                    frame_id,
                    device_time_us,
                    options_.exposure_us,
                    true};
  if (incomplete) {
    frame.complete = false;
    frame.pixels.clear();
    frame.exposure_us = 0;  // travels behind the pixels, so it is lost with them
  }
  Deliver(std::move(frame), duplicate, late);
  return {};
}

void CameraSim::Deliver(CameraFrame frame, bool duplicate, bool late) {
  if (late && !late_) {
    late_ = std::move(frame);
    return;
  }
  if (duplicate) {
    queue_.Push(session_, frame);
  }
  queue_.Push(session_, std::move(frame));
  if (late_) {
    queue_.Push(session_, *std::exchange(late_, std::nullopt));
  }
}

void CameraSim::LoseDevice() {
  present_ = false;
  queue_.PushLost(session_, Fail(ErrorCode::kUnavailable, "simulated camera: the device is gone"));
}

// 53 random bits: the same on every platform, which std::uniform_real_distribution is not.
bool CameraSim::Happens(double chance) { return static_cast<double>(random_() >> 11) * 0x1p-53 < chance; }

std::uint64_t CameraSim::TakeFrameId() {
  const std::uint64_t id = next_frame_id_;
  next_frame_id_ = id == kLastFrameId ? 1 : id + 1;
  return id;
}

}  // namespace forgescan
