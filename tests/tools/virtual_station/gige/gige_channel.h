// GigeChannel: one virtual camera on the loopback interface and its production driver, for tests.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "drivers/camera/camera_aravis.h"
#include "tools/virtual_station/gige/gige_device.h"

namespace forgescan {

inline constexpr int kPatience_ms = 30'000;
inline constexpr std::int64_t kMs_ns = 1'000'000;

// What the driver received stays in `frames`.
struct GigeChannel {
  std::unique_ptr<GigeDevice> device;
  std::unique_ptr<CameraAravis> camera;
  std::vector<CameraFrame> frames;

  std::size_t complete() const;
};

// A camera of kRigWidth_px x kRigHeight_px that shows RigImage(tag).
GigeDeviceConfig SmallDevice(const std::string& address);
// 2448 x 2048, always the same image.
GigeDeviceConfig FullSizeDevice(const std::string& address);
std::shared_ptr<const std::vector<std::uint8_t>> SharedRigImage(std::uint64_t tag);
CameraAravisOptions OptionsFor(const GigeDeviceConfig& config);

std::unique_ptr<GigeChannel> Open(const GigeDeviceConfig& config, const CameraAravisOptions& options);
// `count` edges from first_ns (CLOCK_MONOTONIC) on, tagged 0, 1, 2...
void Fire(GigeChannel& channel, std::int64_t first_ns, std::int64_t period_ns, int count);
// False if fewer frames have come after kPatience_ms.
bool Receive(GigeChannel& channel, std::size_t count);

}  // namespace forgescan
