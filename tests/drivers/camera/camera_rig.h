// CameraRig: one camera and the world around it, for tests that must hold for every kind of camera.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <vector>

#include "drivers/camera/camera.h"

namespace forgescan {

inline constexpr int kRigWidth_px = 640;
inline constexpr int kRigHeight_px = 512;
inline constexpr std::int64_t kRigExposure_us = 2000;
inline constexpr std::int64_t kRigPeriod_us =
    10'000;  // a frame of 640 x 512 takes 2.7 ms on 1 Gbit/s, after the exposure

// What goes wrong with every trigger until set again.
enum class RigFault { kNone, kTriggerLost, kFrameLost, kFrameIncomplete };

class CameraRig {
 public:
  virtual ~CameraRig() = default;
  virtual Camera& camera() = 0;
  // One edge, kRigPeriod_us after the last one, with the image RigImage(tag); gives the edge's time.
  virtual std::int64_t Trigger(std::uint64_t tag) = 0;
  virtual void SetFault(RigFault fault) = 0;
  virtual void LoseDevice() = 0;
  virtual void RestoreDevice() = 0;
};

std::vector<std::uint8_t> RigImage(std::uint64_t tag);

std::unique_ptr<CameraRig> MakeSimRig(std::uint16_t first_frame_id);
// CameraAravis on a GigeDevice over the loopback interface.
std::unique_ptr<CameraRig> MakeGigeRig(std::uint16_t first_frame_id);

// Dispatches until `done`; false after `limit_ms`.
bool DispatchUntil(Camera& camera, const std::function<bool()>& done, int limit_ms);

}  // namespace forgescan
