// What comes of a view after its result: nothing begins again, nothing is published twice.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "services/common/bus/channels.h"
#include "services/common/bus/sim_bus.h"
#include "services/reconstruction/reconstruction_service.h"

namespace forgescan {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

constexpr int kFrames = 8;
constexpr std::int64_t kSecondUs = 1'000'000;
constexpr auto kLeft = fsmsg::exposure_t::CAMERA_LEFT;
constexpr auto kRight = fsmsg::exposure_t::CAMERA_RIGHT;

PatternSet EightFrames() {
  PatternSet pattern;
  pattern.frame_names.assign(kFrames, "frame.png");
  return pattern;
}

class FinishedViewsTest : public ::testing::Test {
 protected:
  FinishedViewsTest() {
    listener_.Subscribe<fsmsg::view_result_t>(kViewResult,
                                              [this](const auto& result) { results_.push_back(result); });
    network_.RunFor(kSecondUs);
  }
  void Arrive(int part, std::int64_t utime) {
    fsmsg::part_arrived_t arrived{};
    arrived.utime = utime;
    arrived.part = part;
    ASSERT_TRUE(sender_.Publish(kPartArrived, arrived).ok());
    network_.RunFor(kSecondUs / 10);
  }
  void Captured(int part, int fired = kFrames) {
    fsmsg::view_captured_t captured{};
    captured.utime = network_.NowUs();
    captured.part = part;
    captured.status = fsmsg::view_captured_t::STATUS_CAPTURED;
    captured.pulses_expected = fired;
    ASSERT_TRUE(sender_.Publish(kViewCaptured, captured).ok());
    network_.RunFor(kSecondUs / 10);
  }
  void Manifest(int part, std::int8_t camera, int missing) {
    fsmsg::view_frames_t manifest{};
    manifest.utime = network_.NowUs() - kSecondUs / 10;
    manifest.part = part;
    manifest.camera = camera;
    manifest.frames_expected = kFrames;
    manifest.frames_sent = kFrames - missing;
    manifest.frames_missing = missing;
    manifest.reason = missing > 0 ? "pulse 4 brought no image in time" : "";
    ASSERT_TRUE(sender_.Publish(camera == kLeft ? kViewFramesLeft : kViewFramesRight, manifest).ok());
    network_.RunFor(kSecondUs / 10);
  }
  void Frame(int part, int pattern) {
    fsmsg::frame_t frame{};
    frame.utime = network_.NowUs() - kSecondUs / 10;
    frame.part = part;
    frame.camera = kRight;
    frame.pattern = pattern;
    frame.width_px = frame.height_px = 4;
    frame.size = 16;
    frame.data.assign(16, 7);
    ASSERT_TRUE(sender_.Publish(kFrameRight, frame).ok());
    network_.RunFor(kSecondUs / 10);
  }

  SimNetwork network_;
  StreamHub hub_{network_.AddNode(), "reconstruction"};
  StreamHub sender_{network_.AddNode(), "sender"};
  StreamHub listener_{network_.AddNode(), "listener"};
  ServiceMonitor monitor_{hub_, "reconstruction", ""};
  ReconstructionService service_{hub_, monitor_, {}, EightFrames(), {}};
  std::vector<fsmsg::view_result_t> results_;
};

TEST_F(FinishedViewsTest, SecondManifestAndLateFramesChangeNothing) {
  Captured(1);
  Manifest(1, kLeft, 1);
  ASSERT_EQ(results_.size(), 1U);
  EXPECT_THAT(results_[0].reason, HasSubstr("pulse 4"));
  Manifest(1, kRight, 1);
  Frame(1, 3);
  network_.RunFor(60 * kSecondUs);  // longer than the timeout of a collection
  EXPECT_EQ(results_.size(), 1U);
  EXPECT_EQ(monitor_.counter("messages_late"), 2);
}

TEST_F(FinishedViewsTest, CapturedAfterTheResultChangesNothing) {
  Manifest(1, kLeft, 1);
  Captured(1);
  network_.RunFor(60 * kSecondUs);
  EXPECT_EQ(results_.size(), 1U);
}

TEST_F(FinishedViewsTest, TheSameNumbersMuchLaterAreAnotherPart) {
  for (std::size_t i = 1; i <= 3; ++i) {
    Captured(1);
    Manifest(1, kLeft, 1);
    EXPECT_EQ(results_.size(), i);
    network_.RunFor(60 * kSecondUs);
  }
}

TEST_F(FinishedViewsTest, TheSameNumbersSoonAreAnotherPartOnceItHasArrived) {
  for (std::size_t i = 1; i <= 3; ++i) {
    Arrive(1, network_.NowUs());
    Captured(1);
    Manifest(1, kLeft, 1);
    EXPECT_EQ(results_.size(), i);
    network_.RunFor(5 * kSecondUs);
  }
  EXPECT_EQ(monitor_.counter("messages_late"), 0);
}

TEST_F(FinishedViewsTest, AnUnfinishedViewLeavesNoFramesToTheNextPart) {
  Arrive(1, network_.NowUs());
  Frame(1, 0);
  Frame(1, 1);
  network_.RunFor(5 * kSecondUs);
  Arrive(1, network_.NowUs());
  Frame(1, 2);
  Manifest(1, kLeft, 1);
  ASSERT_EQ(results_.size(), 1U);
  EXPECT_EQ(results_[0].frames_used, 1);
}

TEST_F(FinishedViewsTest, NorOnAClockSetBackNorWithoutAnArrival) {
  Arrive(1, network_.NowUs() + 3600 * kSecondUs);  // by a clock that is set back afterwards
  Captured(1);
  EXPECT_EQ(monitor_.counter("messages_late"), 1);
  Arrive(1, network_.NowUs());
  Frame(1, 0);
  network_.RunFor(60 * kSecondUs);
  Frame(1, 1);
  Manifest(1, kLeft, 1);
  ASSERT_EQ(results_.size(), 1U);
  EXPECT_EQ(results_[0].frames_used, 1);
}

TEST_F(FinishedViewsTest, AnArrivalThatComesLateIsStillThePartsOwn) {
  const std::int64_t arrival_utime = network_.NowUs();
  network_.RunFor(kSecondUs);
  Frame(1, 0);
  Arrive(1, arrival_utime);
  Manifest(1, kLeft, 1);
  ASSERT_EQ(results_.size(), 1U);
  EXPECT_EQ(results_[0].frames_used, 1);
  Captured(1);
  EXPECT_EQ(results_.size(), 1U);
  EXPECT_EQ(monitor_.counter("messages_late"), 1);
}

TEST_F(FinishedViewsTest, TheTimeoutOfAnEarlierPartIsNotTheNextOnes) {
  Captured(1);
  network_.RunFor(20 * kSecondUs);
  Arrive(1, network_.NowUs());
  Captured(1);
  network_.RunFor(20 * kSecondUs);  // the timeout is 30 s
  EXPECT_TRUE(results_.empty());
  network_.RunFor(20 * kSecondUs);
  EXPECT_EQ(results_.size(), 1U);
}

TEST_F(FinishedViewsTest, AViewWithoutAFrameHasATimeAllTheSame) {
  std::vector<fsmsg::processing_time_t> times;
  listener_.Subscribe<fsmsg::processing_time_t>(kReconstructionTime,
                                                [&times](const auto& time) { times.push_back(time); });
  network_.RunFor(kSecondUs);
  const std::int64_t captured_utime = network_.NowUs();
  Captured(1, 7);
  ASSERT_EQ(results_.size(), 1U);
  EXPECT_EQ(results_[0].utime, captured_utime);
  ASSERT_EQ(times.size(), 1U);
  EXPECT_EQ(times[0].utime, captured_utime);
}

TEST_F(FinishedViewsTest, AnotherNumberOfPatternsThanInTheFileIsNamedWithBoth) {
  Captured(1, 7);
  ASSERT_EQ(results_.size(), 1U);
  EXPECT_THAT(results_[0].reason, AllOf(HasSubstr("7 patterns"), HasSubstr("8 frames")));
}

TEST_F(FinishedViewsTest, ManyViewsWithoutAnEndDropTheOldest) {
  for (int part = 20; part > 0; --part) {
    Frame(part, 0);
  }
  Manifest(1, kLeft, 1);  // the youngest is still there
  ASSERT_EQ(results_.size(), 1U);
  EXPECT_EQ(results_[0].frames_used, 1);
}

}  // namespace
}  // namespace forgescan
