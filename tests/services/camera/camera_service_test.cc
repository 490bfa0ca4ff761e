#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/services/camera/camera_service_rig.h"

namespace forgescan {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

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
