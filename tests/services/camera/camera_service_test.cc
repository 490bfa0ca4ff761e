#include "services/camera/camera_service.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "drivers/camera/camera_sim.h"
#include "services/common/bus/channels.h"
#include "services/common/bus/sim_bus.h"

namespace forgescan {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

constexpr std::int64_t kSecondUs = 1'000'000;
constexpr std::int64_t kPulsePeriodUs = 40'000;
constexpr std::int64_t kClockOffsetUs =
    7'654'321;  // camera clock - controller clock; the service is not told
constexpr int kPatterns = 8;
constexpr int kWidthPx = 32;
constexpr int kHeightPx = 16;
constexpr auto kLeft = fsmsg::exposure_t::CAMERA_LEFT;
constexpr auto kRight = fsmsg::exposure_t::CAMERA_RIGHT;

std::vector<std::uint8_t> ImageOf(int pulse) {
  return std::vector<std::uint8_t>(std::size_t{kWidthPx} * kHeightPx, static_cast<std::uint8_t>(pulse));
}

// The left camera's service, the controller that fires it, and a listener.
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

TEST_F(CameraServiceTest, Starts) {
  Start();
  EXPECT_EQ(monitor_.state(), ServiceState::kReady);
  EXPECT_TRUE(frames_.empty());
}

TEST_F(CameraServiceTest, SendsEveryFrameOfAViewWithItsPulse) {
  Start();
  View(3, 2);
  ASSERT_EQ(frames_.size(), static_cast<std::size_t>(kPatterns));
  for (int i = 0; i < kPatterns; ++i) {
    const fsmsg::frame_t& frame = frames_[static_cast<std::size_t>(i)];
    EXPECT_EQ(frame.part, 3);
    EXPECT_EQ(frame.view, 2);
    EXPECT_EQ(frame.camera, kLeft);
    EXPECT_EQ(frame.pattern, i);
    EXPECT_EQ(frame.pulse, i + 1);
    EXPECT_EQ(frame.device_time_us, frame.utime + kClockOffsetUs);
    EXPECT_EQ(frame.width_px, kWidthPx);
    EXPECT_EQ(frame.data, ImageOf(frame.pulse));
  }
  ASSERT_EQ(manifests_.size(), 1u);
  ExpectWhole(manifests_[0]);
  EXPECT_EQ(manifests_[0].part, 3);
  EXPECT_EQ(manifests_[0].view, 2);
  EXPECT_EQ(monitor_.counter("frames_sent"), kPatterns);
}

TEST_F(CameraServiceTest, AnExposureThatIsNotTheOrderedOneIsNoFrame) {
  Start();
  ordered_exposure_us_ += 1000;
  View(1, 0);
  EXPECT_TRUE(frames_.empty());
  ASSERT_EQ(manifests_.size(), 1u);
  EXPECT_EQ(manifests_[0].frames_missing, kPatterns);
  EXPECT_THAT(manifests_[0].reason, AllOf(HasSubstr("13000 us"), HasSubstr("12000 us")));
  ordered_exposure_us_ -= 1000;
  View(1, 1);
  EXPECT_EQ(frames_.size(), static_cast<std::size_t>(kPatterns));
}

// The trigger service was started again: its pulses are counted from 1.
TEST_F(CameraServiceTest, PulsesCountedFromTheBeginningCostNoView) {
  Start();
  for (int view = 0; view < 3; ++view) {
    View(1, view);
  }
  pulse_ = 0;
  for (int view = 3; view < 6; ++view) {
    View(1, view);
  }
  ASSERT_EQ(manifests_.size(), 6u);
  for (const auto& manifest : manifests_) {
    ExpectWhole(manifest);
  }
}

TEST_F(CameraServiceTest, NamesThePulseWhoseTriggerWasLost) {
  const auto manifest = FaultyThenWhole({.lost_trigger_chance = 1});
  EXPECT_EQ(manifest.frames_sent, kPatterns - 1);
  EXPECT_EQ(manifest.frames_missing, 1);
  EXPECT_THAT(manifest.reason,
              AllOf(HasSubstr("part 1 view 0"), HasSubstr("pulse 4"), HasSubstr("no image")));
  EXPECT_EQ(monitor_.counter("frames_missing"), 1);
}

TEST_F(CameraServiceTest, NamesThePulseWhoseFrameWasLost) {
  const auto manifest = FaultyThenWhole({.lost_frame_chance = 1});
  EXPECT_EQ(manifest.frames_missing, 1);
  EXPECT_THAT(manifest.reason, HasSubstr("pulse 4"));
}

TEST_F(CameraServiceTest, AFrameWithHolesIsNotSent) {
  const auto manifest = FaultyThenWhole({.incomplete_chance = 1});
  EXPECT_EQ(manifest.frames_missing, 1);
  EXPECT_THAT(manifest.reason, AllOf(HasSubstr("pulse 4"), HasSubstr("holes")));
  EXPECT_EQ(frames_.size(), static_cast<std::size_t>(2 * kPatterns - 1));
}

TEST_F(CameraServiceTest, ADuplicateIsCountedAndSentOnce) {
  const auto manifest = FaultyThenWhole({.duplicate_chance = 1});
  ExpectWhole(manifest);
  EXPECT_EQ(manifest.frames_duplicate, 1);
  EXPECT_EQ(frames_.size(), static_cast<std::size_t>(2 * kPatterns));
}

TEST_F(CameraServiceTest, AFrameThatIsOvertakenFindsItsPulse) {
  ExpectWhole(FaultyThenWhole({.late_chance = 1}));
  for (const auto& frame : frames_) {
    EXPECT_EQ(frame.data, ImageOf(frame.pulse));
  }
}

TEST_F(CameraServiceTest, AFrameAfterItsDeadlineIsNotSent) {
  Start();
  for (int pattern = 0; pattern < kPatterns; ++pattern) {
    Fire(1, 0, pattern, {.late_chance = pattern == kPatterns - 1 ? 1.0 : 0.0});
  }
  Captured(1, 0);
  network_.RunFor(2 * kSecondUs);
  View(1, 1);  // its first frame brings the late one along
  ASSERT_EQ(manifests_.size(), 2u);
  EXPECT_EQ(manifests_[0].frames_missing, 1);
  ExpectWhole(manifests_[1]);
  EXPECT_EQ(monitor_.counter("frames_late") + monitor_.counter("frames_stray"), 1);
  EXPECT_EQ(frames_.size(), static_cast<std::size_t>(2 * kPatterns - 1));
}

TEST_F(CameraServiceTest, RecordsAndFramesLostOnTheBusAreResent) {
  Start();
  network_.SetFaults({.loss = 0.3, .large_loss = 0.3, .duplicate = 0.1, .jitter_us = 30'000});
  for (int view = 0; view < 4; ++view) {
    View(1, view);
  }
  network_.RunFor(10 * kSecondUs);
  ASSERT_EQ(manifests_.size(), 4u);
  for (const auto& manifest : manifests_) {
    ExpectWhole(manifest);
  }
  ASSERT_EQ(frames_.size(), static_cast<std::size_t>(4 * kPatterns));
  for (const auto& frame : frames_) {
    EXPECT_EQ(frame.data, ImageOf(frame.pulse));
  }
  EXPECT_GT(hub_.counters().recovered, 0);
  EXPECT_EQ(hub_.counters().missing, 0);
}

TEST_F(CameraServiceTest, RecordsThatNeverComeAreMissing) {
  Start();
  send_records_ = false;
  View(1, 0);
  EXPECT_TRUE(manifests_.empty());
  network_.RunFor(15 * kSecondUs);  // view_timeout_s
  ASSERT_EQ(manifests_.size(), 1u);
  EXPECT_EQ(manifests_[0].frames_missing, kPatterns);
  EXPECT_THAT(manifests_[0].reason, HasSubstr("never came"));
  EXPECT_EQ(monitor_.counter("frames_stray"), kPatterns);
  send_records_ = true;
  View(1, 1);
  ASSERT_EQ(manifests_.size(), 2u);
  ExpectWhole(manifests_[1]);
}

TEST_F(CameraServiceTest, AVoidCaptureHasNoManifest) {
  Start();
  Fire(1, 0, 0);
  Captured(1, 0, false);
  network_.RunFor(20 * kSecondUs);
  EXPECT_TRUE(manifests_.empty());
  View(1, 1);
  ASSERT_EQ(manifests_.size(), 1u);
  ExpectWhole(manifests_[0]);
}

TEST_F(CameraServiceTest, WaitsForACameraThatIsAbsentAtTheStart) {
  camera_.LoseDevice();
  Start();
  EXPECT_EQ(monitor_.state(), ServiceState::kDegraded);
  EXPECT_THAT(monitor_.last_error(), HasSubstr("does not answer"));
  camera_.RestoreDevice();
  network_.RunFor(2 * kSecondUs);
  EXPECT_EQ(monitor_.state(), ServiceState::kReady);
  View(1, 0);
  ASSERT_EQ(manifests_.size(), 1u);
  ExpectWhole(manifests_[0]);
}

TEST_F(CameraServiceTest, ACameraThatGoesVoidsTheViewAndIsFoundAgain) {
  Start();
  View(1, 0);
  for (int pattern = 0; pattern < kPatterns; ++pattern) {
    if (pattern == 5) {
      camera_.LoseDevice();
    }
    Fire(1, 1, pattern);
  }
  Captured(1, 1);
  network_.RunFor(2 * kSecondUs);
  EXPECT_EQ(monitor_.state(), ServiceState::kDegraded);
  EXPECT_EQ(monitor_.counter("devices_lost"), 1);
  ASSERT_EQ(manifests_.size(), 2u);
  EXPECT_EQ(manifests_[1].frames_missing, 3);
  camera_.RestoreDevice();
  network_.RunFor(2 * kSecondUs);
  EXPECT_EQ(monitor_.state(), ServiceState::kReady);
  View(1, 2);
  ASSERT_EQ(manifests_.size(), 3u);
  ExpectWhole(manifests_[2]);
}

}  // namespace
}  // namespace forgescan
