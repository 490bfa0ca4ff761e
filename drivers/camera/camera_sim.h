// CameraSim: a Camera in this process, fired by a method call; fails on demand in every way a real one does.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <random>
#include <vector>

#include "drivers/camera/queued_camera.h"

namespace forgescan {

// Chances are per trigger, 0..1, drawn in the order of the members from one generator: equal seeds, equal
// faults.
struct CameraSimFaults {
  double lost_trigger_chance = 0;  // the edge never reached the sensor: no frame, no id used
  double lost_frame_chance = 0;    // exposed, but no packet arrived: no frame, id used
  double incomplete_chance = 0;    // delivered with complete = false
  double duplicate_chance = 0;     // delivered twice
  double late_chance = 0;          // delivered after the next frame that is on time
};

struct CameraSimOptions {
  int width_px = 640;
  int height_px = 512;
  std::int64_t exposure_us = 5000;
  std::uint64_t seed = 1;
  std::uint64_t first_frame_id = 1;  // 1..65535; near 65535 to see the wrap
  std::size_t queue_capacity_frames = 64;
  CameraSimFaults faults;
};

// Same states and rules as Camera. Trigger(), LoseDevice() and the rest on the owner's thread.
class CameraSim : public QueuedCamera {
 public:
  explicit CameraSim(CameraSimOptions options);

  Status Start() override;
  void Stop() override;
  CameraCounters counters() const override;

  // One hardware edge at the camera's clock with the image the sensor would see.
  // Errors: kInvalidArgument if the image is not width_px * height_px bytes.
  Status Trigger(std::int64_t device_time_us, std::vector<std::uint8_t> image);
  // Pulls the plug: the next Dispatch() reports the loss. Start() fails until RestoreDevice().
  void LoseDevice();
  void RestoreDevice() { present_ = true; }
  void SetFaults(const CameraSimFaults& faults) { options_.faults = faults; }

 private:
  void OnLost() override { late_.reset(); }
  bool Happens(double chance);
  void Deliver(CameraFrame frame, bool duplicate, bool late);
  std::uint64_t TakeFrameId();

  CameraSimOptions options_;
  std::mt19937_64 random_;
  std::uint64_t session_ = 0;
  std::uint64_t next_frame_id_ = 1;
  std::uint64_t triggers_ignored_ = 0;
  std::uint64_t late_discarded_ = 0;
  std::optional<CameraFrame> late_;
  bool present_ = true;
};

}  // namespace forgescan
