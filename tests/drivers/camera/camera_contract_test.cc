// What every Camera keeps, simulated or on a wire. A tolerance appears nowhere: ids, times and pixels are
// exact.
#include <gtest/gtest.h>

#include <memory>
#include <string>
#include <vector>

#include "tests/drivers/camera/camera_rig.h"

namespace forgescan {
namespace {

constexpr int kPatience_ms = 20'000;  // for a loaded machine under a sanitizer; usually some 10 ms

struct RigKind {
  const char* name;
  std::unique_ptr<CameraRig> (*make)(std::uint16_t first_frame_id);
};

class CameraContract : public testing::TestWithParam<RigKind> {
 protected:
  void Make(std::uint16_t first_frame_id = 1) {
    rig_ = GetParam().make(first_frame_id);
    rig_->camera().SetHandler([this](CameraFrame frame) { frames_.push_back(std::move(frame)); });
    rig_->camera().SetLostHandler([this](const Error& error) { losses_.push_back(error.message); });
  }
  void Start() {
    const Status started = rig_->camera().Start();
    ASSERT_TRUE(started.ok()) << started.error().message;
  }
  // Triggers one after the other, each with its number since the start of the test as tag.
  void Trigger(int count) {
    for (int i = 0; i < count; ++i) {
      times_us_.push_back(rig_->Trigger(times_us_.size()));
    }
  }
  bool Receive(std::size_t count) {
    return DispatchUntil(
        rig_->camera(), [&] { return frames_.size() >= count; }, kPatience_ms);
  }
  void ExpectFrame(std::size_t index, std::uint64_t id, std::size_t tag) {
    ASSERT_LT(index, frames_.size());
    const CameraFrame& frame = frames_[index];
    EXPECT_TRUE(frame.complete);
    EXPECT_EQ(frame.frame_id, id);
    EXPECT_EQ(frame.device_time_us, times_us_.at(tag));
    EXPECT_EQ(frame.exposure_us, kRigExposure_us);
    EXPECT_EQ(frame.width_px, kRigWidth_px);
    EXPECT_EQ(frame.height_px, kRigHeight_px);
    EXPECT_TRUE(frame.pixels == RigImage(tag)) << "pixels of frame " << index;
  }

  std::unique_ptr<CameraRig> rig_;
  std::vector<CameraFrame> frames_;
  std::vector<std::string> losses_;
  std::vector<std::int64_t> times_us_;
};

TEST_P(CameraContract, Starts) {
  Make();
  EXPECT_EQ(rig_->camera().state(), Camera::State::kClosed);
  Start();
  EXPECT_EQ(rig_->camera().state(), Camera::State::kStreaming);
  EXPECT_EQ(rig_->camera().Start().error().code, ErrorCode::kInvalidArgument);
  EXPECT_EQ(rig_->camera().state(), Camera::State::kStreaming);
  rig_->camera().Stop();
  EXPECT_EQ(rig_->camera().state(), Camera::State::kClosed);
}

TEST_P(CameraContract, FramesComeInOrderWithIdTimeAndPixels) {
  Make();
  Start();
  Trigger(12);
  ASSERT_TRUE(Receive(12));
  for (std::size_t i = 0; i < 12; ++i) {
    ExpectFrame(i, i + 1, i);
  }
  EXPECT_EQ(rig_->camera().counters().frames_complete, 12U);
  EXPECT_EQ(rig_->camera().counters().frames_incomplete, 0U);
}

TEST_P(CameraContract, IdAfter65535Is1) {
  Make(65534);
  Start();
  Trigger(4);
  ASSERT_TRUE(Receive(4));
  ExpectFrame(0, 65534, 0);
  ExpectFrame(1, 65535, 1);
  ExpectFrame(2, 1, 2);
  ExpectFrame(3, 2, 3);
}

TEST_P(CameraContract, LostTriggerLeavesAHoleInTimeOnly) {
  Make();
  Start();
  Trigger(1);
  rig_->SetFault(RigFault::kTriggerLost);
  Trigger(1);
  rig_->SetFault(RigFault::kNone);
  Trigger(1);
  ASSERT_TRUE(Receive(2));
  ExpectFrame(0, 1, 0);
  ExpectFrame(1, 2, 2);
}

TEST_P(CameraContract, LostFrameLeavesAHoleInIdAndTime) {
  Make();
  Start();
  Trigger(1);
  rig_->SetFault(RigFault::kFrameLost);
  Trigger(1);
  rig_->SetFault(RigFault::kNone);
  Trigger(1);
  ASSERT_TRUE(Receive(2));
  ExpectFrame(0, 1, 0);
  ExpectFrame(1, 3, 2);
}

TEST_P(CameraContract, IncompleteFrameIsDeliveredAsSuchAndTheNextIsWhole) {
  Make();
  Start();
  Trigger(1);
  ASSERT_TRUE(Receive(1));
  rig_->SetFault(RigFault::kFrameIncomplete);
  Trigger(1);
  ASSERT_TRUE(Receive(2));
  rig_->SetFault(RigFault::kNone);
  Trigger(1);
  ASSERT_TRUE(Receive(3));
  ExpectFrame(0, 1, 0);
  EXPECT_FALSE(frames_[1].complete);
  EXPECT_TRUE(frames_[1].frame_id == 2 || frames_[1].frame_id == 0) << frames_[1].frame_id;  // 0 = UNKNOWN
  EXPECT_TRUE(frames_[1].pixels.empty());
  ExpectFrame(2, 3, 2);
  EXPECT_EQ(rig_->camera().counters().frames_incomplete, 1U);
}

TEST_P(CameraContract, StopAndStartWorkAgain) {
  Make();
  for (std::size_t round = 0; round < 3; ++round) {
    Start();
    Trigger(3);
    ASSERT_TRUE(Receive(3 * round + 3));
    ExpectFrame(3 * round, 1, 3 * round);
    rig_->camera().Stop();
  }
  EXPECT_EQ(rig_->camera().counters().frames_complete, 9U);
  EXPECT_TRUE(losses_.empty());
}

TEST_P(CameraContract, HandlerMayStopAndWhatWaitedIsCounted) {
  Make();
  Start();
  std::size_t seen = 0;
  rig_->camera().SetHandler([&](CameraFrame) {
    ++seen;
    rig_->camera().Stop();
  });
  Trigger(3);
  ASSERT_TRUE(DispatchUntil(
      rig_->camera(), [&] { return seen == 1; }, kPatience_ms));
  rig_->camera().Dispatch();
  EXPECT_EQ(seen, 1U);
  EXPECT_EQ(rig_->camera().state(), Camera::State::kClosed);
  const CameraCounters counters = rig_->camera().counters();
  EXPECT_LE(counters.frames_complete, 1U + counters.frames_discarded);
}

TEST_P(CameraContract, LostDeviceIsReportedOnceAndCanBeStartedAgain) {
  Make();
  Start();
  Trigger(1);
  ASSERT_TRUE(Receive(1));
  rig_->LoseDevice();
  ASSERT_TRUE(DispatchUntil(
      rig_->camera(), [&] { return !losses_.empty(); }, kPatience_ms));
  EXPECT_EQ(rig_->camera().state(), Camera::State::kLost);
  EXPECT_EQ(losses_.size(), 1U);
  EXPECT_FALSE(losses_[0].empty());
  EXPECT_EQ(rig_->camera().counters().devices_lost, 1U);
  rig_->RestoreDevice();
  Start();
  Trigger(1);
  ASSERT_TRUE(Receive(2));
  ExpectFrame(1, 1, 1);
  EXPECT_EQ(losses_.size(), 1U);
}

TEST_P(CameraContract, LostCameraCanBeStopped) {
  Make();
  Start();
  rig_->LoseDevice();
  ASSERT_TRUE(DispatchUntil(
      rig_->camera(), [&] { return !losses_.empty(); }, kPatience_ms));
  rig_->camera().Stop();
  EXPECT_EQ(rig_->camera().state(), Camera::State::kClosed);
}

INSTANTIATE_TEST_SUITE_P(Cameras, CameraContract,
                         testing::Values(RigKind{"Sim", MakeSimRig},
                                         RigKind{"AravisOnGigeDevice", MakeGigeRig}),
                         [](const auto& test) { return std::string(test.param.name); });

}  // namespace
}  // namespace forgescan
