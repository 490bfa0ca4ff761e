// One virtual camera with the production driver in front of it, over the loopback interface.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "drivers/camera/camera_aravis.h"
#include "tests/drivers/camera/camera_rig.h"
#include "tools/virtual_station/gige/gige_device.h"

namespace forgescan {

inline constexpr std::int64_t kMs_ns = 1'000'000;

// What the driver received stays in `frames`.
struct Channel {
  std::unique_ptr<GigeDevice> device;
  std::unique_ptr<CameraAravis> camera;
  std::vector<CameraFrame> frames;

  std::size_t complete() const;
};

std::shared_ptr<const std::vector<std::uint8_t>> SharedRigImage(std::uint64_t tag);
// A camera of kRigWidth_px x kRigHeight_px, and options that fit it.
GigeDeviceConfig SmallDevice(const std::string& address);
CameraAravisOptions OptionsFor(const GigeDeviceConfig& config);

// Expects both to start.
std::unique_ptr<Channel> Open(const GigeDeviceConfig& config, const CameraAravisOptions& options);
// `count` edges with tags 0, 1, ...
void Fire(Channel& channel, std::int64_t first_ns, std::int64_t period_ns, int count);
// False if `count` frames, whole or not, have not come within 30 s.
bool Receive(Channel& channel, std::size_t count);

}  // namespace forgescan
