#include "tests/tools/virtual_station/gige/gige_channel.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <utility>

#include "tests/drivers/camera/camera_rig.h"

namespace forgescan {
namespace {

std::shared_ptr<const std::vector<std::uint8_t>> FullSizeImage() {
  const auto image = std::make_shared<std::vector<std::uint8_t>>(std::size_t{2448} * 2048);
  for (std::size_t i = 0; i < image->size(); ++i) {
    (*image)[i] = static_cast<std::uint8_t>((i * 2654435761U) >> 13);
  }
  return image;
}

}  // namespace

std::shared_ptr<const std::vector<std::uint8_t>> SharedRigImage(std::uint64_t tag) {
  return std::make_shared<const std::vector<std::uint8_t>>(RigImage(tag));
}

std::size_t GigeChannel::complete() const {
  return static_cast<std::size_t>(
      std::count_if(frames.begin(), frames.end(), [](const CameraFrame& frame) { return frame.complete; }));
}

GigeDeviceConfig SmallDevice(const std::string& address) {
  GigeDeviceConfig config;
  config.address = address;
  config.serial = address;
  config.width_px = kRigWidth_px;
  config.height_px = kRigHeight_px;
  config.image = SharedRigImage;
  return config;
}

GigeDeviceConfig FullSizeDevice(const std::string& address) {
  GigeDeviceConfig config = SmallDevice(address);
  config.width_px = 2448;
  config.height_px = 2048;
  config.image = [image = FullSizeImage()](std::uint64_t) { return image; };
  return config;
}

CameraAravisOptions OptionsFor(const GigeDeviceConfig& config) {
  CameraAravisOptions options;
  options.address = config.address;
  options.width_px = config.width_px;
  options.height_px = config.height_px;
  options.exposure_us = kRigExposure_us;
  options.teardown_wait_ms = 10'000;
  options.realtime_thread = false;
  options.queue_capacity_frames = 200;
  return options;
}

std::unique_ptr<GigeChannel> Open(const GigeDeviceConfig& config, const CameraAravisOptions& options) {
  auto channel = std::make_unique<GigeChannel>();
  auto device = GigeDevice::Create(config);
  EXPECT_TRUE(device.ok()) << device.error().message;
  channel->device = std::move(device).value();
  channel->camera = std::make_unique<CameraAravis>(options);
  channel->camera->SetHandler(
      [self = channel.get()](CameraFrame frame) { self->frames.push_back(std::move(frame)); });
  const Status started = channel->camera->Start();
  EXPECT_TRUE(started.ok()) << started.error().message;
  return channel;
}

void Fire(GigeChannel& channel, std::int64_t first_ns, std::int64_t period_ns, int count) {
  for (int i = 0; i < count; ++i) {
    channel.device->Edge(first_ns + i * period_ns, static_cast<std::uint64_t>(i));
  }
}

bool Receive(GigeChannel& channel, std::size_t count) {
  return DispatchUntil(
      *channel.camera, [&] { return channel.frames.size() >= count; }, kPatience_ms);
}

}  // namespace forgescan
