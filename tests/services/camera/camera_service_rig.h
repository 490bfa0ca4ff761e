// CameraServiceTest: the left camera's service on a simulated bus, the controller that fires it, and a
// listener.
#pragma once

#include <gtest/gtest.h>

#include <cstdint>
#include <memory>
#include <vector>

#include "drivers/camera/camera_sim.h"
#include "services/camera/camera_service.h"
#include "services/common/bus/channels.h"
#include "services/common/bus/sim_bus.h"

namespace forgescan {

inline constexpr std::int64_t kSecondUs = 1'000'000;
inline constexpr std::int64_t kPulsePeriodUs = 40'000;
inline constexpr std::int64_t kClockOffsetUs =
    7'654'321;  // camera clock - controller clock; the service is not told
inline constexpr int kPatterns = 8;
inline constexpr int kWidthPx = 32;
inline constexpr int kHeightPx = 16;
inline constexpr auto kLeft = fsmsg::exposure_t::CAMERA_LEFT;
inline constexpr auto kRight = fsmsg::exposure_t::CAMERA_RIGHT;

inline std::vector<std::uint8_t> ImageOf(int pulse) {
  return std::vector<std::uint8_t>(std::size_t{kWidthPx} * kHeightPx, static_cast<std::uint8_t>(pulse));
}

class CameraServiceTest : public ::testing::Test {
 protected:
  CameraServiceTest() {
    listener_.Subscribe<fsmsg::frame_t>(kFrameLeft, [this](const auto& frame) { frames_.push_back(frame); });
    listener_.Subscribe<fsmsg::view_frames_t>(
        kViewFramesLeft, [this](const auto& manifest) { manifests_.push_back(manifest); });
    trigger_.Advertise(kExposure);
    trigger_.Advertise(kViewCaptured);
  }

  static CameraSimOptions CameraOptions() {
    CameraSimOptions options;
    options.width_px = kWidthPx;
    options.height_px = kHeightPx;
    options.exposure_us = CameraConfig{}.exposure_us;
    return options;
  }
  void Start() {
    CameraConfig config;
    config.address = "192.0.2.1";
    service_ = std::make_unique<CameraService>(hub_, monitor_, camera_, config, kLeft);
    camera_node_.Every(1000, [this] { camera_.Dispatch(); });
    network_.RunFor(kSecondUs);
  }

  // One pulse of each camera; the record follows the edge by the exposure.
  void Fire(int part, int view, int pattern, const CameraSimFaults& faults = {}) {
    ++pulse_;
    camera_.SetFaults(faults);
    ASSERT_TRUE(camera_.Trigger(network_.NowUs() + kClockOffsetUs, ImageOf(pulse_)).ok());
    fsmsg::exposure_t exposure{};
    exposure.utime = exposure.device_time_us = network_.NowUs();
    exposure.part = part;
    exposure.view = view;
    exposure.pattern = pattern;
    exposure.pulse = pulse_;
    exposure.exposure_us = ordered_exposure_us_;
    network_.RunFor(kPulsePeriodUs / 2);
    for (const auto camera : {kLeft, kRight}) {
      exposure.camera = camera;
      if (send_records_) {
        ASSERT_TRUE(trigger_.Publish(kExposure, exposure).ok());
      }
    }
    network_.RunFor(kPulsePeriodUs / 2);
  }
  void Captured(int part, int view, bool captured = true) {
    fsmsg::view_captured_t message{};
    message.utime = network_.NowUs();
    message.part = part;
    message.view = view;
    message.status = captured ? fsmsg::view_captured_t::STATUS_CAPTURED : fsmsg::view_captured_t::STATUS_VOID;
    message.pulses_expected = kPatterns;
    ASSERT_TRUE(trigger_.Publish(kViewCaptured, message).ok());
  }
  // A view in which the pulse of pattern `wrong` meets the faults.
  void View(int part, int view, int wrong = -1, const CameraSimFaults& faults = {}) {
    for (int pattern = 0; pattern < kPatterns; ++pattern) {
      Fire(part, view, pattern, pattern == wrong ? faults : CameraSimFaults{});
    }
    Captured(part, view);
    network_.RunFor(2 * kSecondUs);
  }
  void ExpectWhole(const fsmsg::view_frames_t& manifest) {
    EXPECT_EQ(manifest.frames_expected, kPatterns);
    EXPECT_EQ(manifest.frames_sent, kPatterns);
    EXPECT_EQ(manifest.frames_missing, 0);
    EXPECT_EQ(manifest.reason, "");
  }
  // One view with a fault, then one without.
  fsmsg::view_frames_t FaultyThenWhole(const CameraSimFaults& faults) {
    Start();
    View(1, 0, 3, faults);
    View(1, 1);
    EXPECT_EQ(manifests_.size(), 2u);
    ExpectWhole(manifests_.back());
    return manifests_.front();
  }

  SimNetwork network_;
  SimBus& camera_node_ = network_.AddNode();
  StreamHub hub_{camera_node_, "camera_left"};
  StreamHub trigger_{network_.AddNode(), "trigger"};
  StreamHub listener_{network_.AddNode(), "listener"};
  ServiceMonitor monitor_{hub_, "camera_left", ""};
  CameraSim camera_{CameraOptions()};
  std::unique_ptr<CameraService> service_;
  std::vector<fsmsg::frame_t> frames_;
  std::vector<fsmsg::view_frames_t> manifests_;
  int pulse_ = 0;
  bool send_records_ = true;
  int ordered_exposure_us_ = CameraConfig{}.exposure_us;
};

}  // namespace forgescan
