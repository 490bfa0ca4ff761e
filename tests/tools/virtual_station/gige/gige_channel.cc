#include "tests/tools/virtual_station/gige/gige_channel.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <utility>

namespace forgescan {
namespace {

constexpr int kPatience_ms = 30'000;

}  // namespace

std::shared_ptr<const std::vector<std::uint8_t>> SharedRigImage(std::uint64_t tag) {
  return std::make_shared<const std::vector<std::uint8_t>>(RigImage(tag));
}

std::size_t Channel::complete() const {
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

CameraAravisOptions OptionsFor(const GigeDeviceConfig& config) {
  CameraAravisOptions options;
  options.address = config.address;
  options.width_px = config.width_px;
  options.height_px = config.height_px;
  options.exposure_us = kRigExposure_us;
  options.frame_retention_ms = 200;
  options.teardown_wait_ms = 10'000;
  options.realtime_thread = false;
  options.queue_capacity_frames = 200;
  return options;
}

std::unique_ptr<Channel> Open(const GigeDeviceConfig& config, const CameraAravisOptions& options) {
  auto channel = std::make_unique<Channel>();
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

void Fire(Channel& channel, std::int64_t first_ns, std::int64_t period_ns, int count) {
  for (int i = 0; i < count; ++i) {
    channel.device->Edge(first_ns + i * period_ns, static_cast<std::uint64_t>(i));
  }
}

bool Receive(Channel& channel, std::size_t count) {
  return DispatchUntil(
      *channel.camera, [&] { return channel.frames.size() >= count; }, kPatience_ms);
}

}  // namespace forgescan
