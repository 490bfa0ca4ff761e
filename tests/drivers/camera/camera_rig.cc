#include "tests/drivers/camera/camera_rig.h"

#include <gtest/gtest.h>
#include <poll.h>

#include <algorithm>
#include <utility>

#include "drivers/camera/camera_aravis.h"
#include "drivers/camera/camera_sim.h"
#include "tools/virtual_station/gige/gige_device.h"
#include "tools/virtual_station/gige/mono_time.h"

namespace forgescan {
namespace {

class SimRig : public CameraRig {
 public:
  explicit SimRig(std::uint16_t first_frame_id) : camera_(Options(first_frame_id)) {}

  Camera& camera() override { return camera_; }
  std::int64_t Trigger(std::uint64_t tag) override {
    t_us_ += kRigPeriod_us;
    EXPECT_TRUE(camera_.Trigger(t_us_, RigImage(tag)).ok());
    return t_us_;
  }
  void SetFault(RigFault fault) override {
    CameraSimFaults faults;
    faults.lost_trigger_chance = fault == RigFault::kTriggerLost ? 1 : 0;
    faults.lost_frame_chance = fault == RigFault::kFrameLost ? 1 : 0;
    faults.incomplete_chance = fault == RigFault::kFrameIncomplete ? 1 : 0;
    camera_.SetFaults(faults);
  }
  void LoseDevice() override { camera_.LoseDevice(); }
  void RestoreDevice() override { camera_.RestoreDevice(); }

 private:
  static CameraSimOptions Options(std::uint16_t first_frame_id) {
    CameraSimOptions options;
    options.width_px = kRigWidth_px;
    options.height_px = kRigHeight_px;
    options.exposure_us = kRigExposure_us;
    options.first_frame_id = first_frame_id;
    return options;
  }

  CameraSim camera_;
  std::int64_t t_us_ = 1'000'000;
};

class GigeRig : public CameraRig {
 public:
  explicit GigeRig(std::uint16_t first_frame_id) : camera_(Options()) {
    GigeDeviceConfig config;
    config.width_px = kRigWidth_px;
    config.height_px = kRigHeight_px;
    config.first_block_id = first_frame_id;
    config.image = [](std::uint64_t tag) {
      return std::make_shared<const std::vector<std::uint8_t>>(RigImage(tag));
    };
    auto device = GigeDevice::Create(config);
    EXPECT_TRUE(device.ok()) << device.error().message;
    device_ = std::move(device).value();
  }

  Camera& camera() override { return camera_; }
  // Edges are announced ahead of their time, so that their distance does not depend on how busy this machine
  // is.
  std::int64_t Trigger(std::uint64_t tag) override {
    t_ns_ = std::max(t_ns_ + kRigPeriod_us * 1000, MonoNowNs() + 1'000'000) / 1000 * 1000;
    device_->Edge(t_ns_, tag);
    return t_ns_ / 1000;
  }
  void SetFault(RigFault fault) override {
    GigeFaults faults;
    faults.lost_trigger_chance = fault == RigFault::kTriggerLost ? 1 : 0;
    faults.dropped_frame_chance = fault == RigFault::kFrameLost ? 1 : 0;
    faults.packet_loss_chance = fault == RigFault::kFrameIncomplete ? 0.3 : 0;  // of some 40 packets
    faults.resend_unavailable = fault == RigFault::kFrameIncomplete;
    device_->SetFaults(faults);
  }
  void LoseDevice() override { device_->Reboot(100); }
  void RestoreDevice() override {}  // a rebooted device comes back by itself, before its loss is noticed

 private:
  static CameraAravisOptions Options() {
    CameraAravisOptions options;
    options.address = "127.0.0.1";
    options.width_px = kRigWidth_px;
    options.height_px = kRigHeight_px;
    options.exposure_us = kRigExposure_us;
    options.frame_retention_ms = 200;
    options.teardown_wait_ms = 10'000;
    options.realtime_thread = false;
    return options;
  }

  std::unique_ptr<GigeDevice> device_;
  CameraAravis camera_;
  std::int64_t t_ns_ = 0;
};

}  // namespace

std::vector<std::uint8_t> RigImage(std::uint64_t tag) {
  std::vector<std::uint8_t> image(static_cast<std::size_t>(kRigWidth_px) * kRigHeight_px);
  for (std::size_t i = 0; i < image.size(); ++i) {
    image[i] = static_cast<std::uint8_t>(i / 7 + 31 * tag);
  }
  return image;
}

std::unique_ptr<CameraRig> MakeSimRig(std::uint16_t first_frame_id) {
  return std::make_unique<SimRig>(first_frame_id);
}

std::unique_ptr<CameraRig> MakeGigeRig(std::uint16_t first_frame_id) {
  return std::make_unique<GigeRig>(first_frame_id);
}

bool DispatchUntil(Camera& camera, const std::function<bool()>& done, int limit_ms) {
  const std::int64_t end_ns = MonoNowNs() + std::int64_t{limit_ms} * 1'000'000;
  while (!done()) {
    const auto left_ms = static_cast<int>((end_ns - MonoNowNs()) / 1'000'000);
    pollfd readable{camera.fd(), POLLIN, 0};
    if (left_ms <= 0 || ::poll(&readable, 1, left_ms) <= 0) {
      return done();
    }
    camera.Dispatch();
  }
  return true;
}

}  // namespace forgescan
