// Which states of the cooling and of the recorder let the robot take up a part; silence is none of them.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <optional>

#include "drivers/line/line_sim.h"
#include "drivers/robot/robot_sim.h"
#include "services/common/bus/sim_bus.h"
#include "services/robot/robot_service.h"

namespace forgescan {
namespace {

using testing::HasSubstr;
using Cooling = fsmsg::cooling_state_t;
using Recorder = fsmsg::recorder_state_t;

constexpr std::int64_t kSecondUs = 1'000'000;

class RobotInterlockTest : public testing::Test {
 protected:
  RobotInterlockTest() {
    world_.Subscribe<fsmsg::scan_complete_t>(kScanComplete, [this](const auto& m) { scans_.push_back(m); });
    world_.Subscribe<fsmsg::view_ready_t>(kViewReady, [this](const auto&) { ++views_; });
  }
  void SetUp() override {
    service_ = std::make_unique<RobotService>(hub_, monitor_, RobotService::Devices{robot_, line_}, Config());
  }
  virtual RobotConfig Config() const { return {}; }
  void Say(std::int8_t interlock) {
    Cooling state{};
    state.utime = network_.NowUs();
    state.interlock = interlock;
    EXPECT_TRUE(PublishState(world_.bus(), kCoolingState, state).ok());
  }
  // The first part comes within 10 s.
  std::string ReasonOfFirstPart() {
    network_.RunFor(15 * kSecondUs);
    return scans_.empty() ? std::string() : scans_.front().reason;
  }
  static LineSimConfig Line() {
    LineSimConfig config;
    config.first_after_us = 10 * kSecondUs;
    return config;
  }

  SimNetwork network_;
  StreamHub hub_{network_.AddNode(), "robot"};
  StreamHub world_{network_.AddNode(), "world"};
  ServiceMonitor monitor_{hub_, "robot", ""};
  RobotSim robot_;
  LineSim line_{Line()};
  std::unique_ptr<RobotService> service_;
  std::vector<fsmsg::scan_complete_t> scans_;
  int views_ = 0;
};

TEST_F(RobotInterlockTest, ACoolingServiceThatNeverSpokeStops) {
  EXPECT_THAT(ReasonOfFirstPart(), HasSubstr("no state of the cooling yet"));
  EXPECT_EQ(views_, 0);
}

TEST_F(RobotInterlockTest, ACoolingServiceThatFellSilentStops) {
  network_.RunFor(kSecondUs);
  Say(Cooling::INTERLOCK_CLEAR);
  EXPECT_THAT(ReasonOfFirstPart(), HasSubstr("silent"));
}

TEST_F(RobotInterlockTest, AnUnknownStateStops) {
  const Bus::TimerId timer = world_.bus().Every(kSecondUs / 2, [this] { Say(Cooling::INTERLOCK_UNKNOWN); });
  EXPECT_THAT(ReasonOfFirstPart(), HasSubstr("cooling interlock"));
  world_.bus().Cancel(timer);
}

TEST_F(RobotInterlockTest, AClearOneLetsItGo) {
  const Bus::TimerId timer = world_.bus().Every(kSecondUs / 2, [this] { Say(Cooling::INTERLOCK_CLEAR); });
  EXPECT_EQ(ReasonOfFirstPart(), "");
  EXPECT_GT(views_, 0);
  world_.bus().Cancel(timer);
}

// With a recorder that is required, and a cooling that is clear.
class RobotRecordingTest : public RobotInterlockTest {
 protected:
  RobotRecordingTest() {
    world_.bus().Every(kSecondUs / 2, [this] {
      Say(Cooling::INTERLOCK_CLEAR);
      if (status_.has_value()) {
        Recorder state{};
        state.status = *status_;
        state.reason = "the disk is full";
        EXPECT_TRUE(PublishState(world_.bus(), kRecorderState, state).ok());
      }
    });
  }
  RobotConfig Config() const override {
    RobotConfig config;
    config.require_recording = true;
    return config;
  }
  std::optional<std::int8_t> status_;
};

TEST_F(RobotRecordingTest, ARecorderThatNeverSpokeHoldsThePart) {
  EXPECT_THAT(ReasonOfFirstPart(), HasSubstr("no state of the recorder yet"));
  EXPECT_EQ(views_, 0);
}

TEST_F(RobotRecordingTest, OneThatIsStoppedHoldsItWithItsReason) {
  status_ = Recorder::STATUS_STOPPED;
  EXPECT_THAT(ReasonOfFirstPart(), HasSubstr("recording interlock: the disk is full"));
  EXPECT_EQ(views_, 0);
}

TEST_F(RobotRecordingTest, AnUnknownStateHoldsIt) {
  status_ = Recorder::STATUS_UNKNOWN;
  EXPECT_THAT(ReasonOfFirstPart(), HasSubstr("recording interlock"));
}

TEST_F(RobotRecordingTest, OneThatFellSilentHoldsIt) {
  status_ = Recorder::STATUS_RECORDING;
  network_.RunFor(kSecondUs);
  status_.reset();
  EXPECT_THAT(ReasonOfFirstPart(), HasSubstr("the recorder is silent"));
}

TEST_F(RobotRecordingTest, OneThatRecordsLetsItGo) {
  status_ = Recorder::STATUS_RECORDING;
  EXPECT_EQ(ReasonOfFirstPart(), "");
  EXPECT_GT(views_, 0);
}

TEST_F(RobotRecordingTest, AScanThatHasBegunIsFinishedAndTheNextPartHeld) {
  world_.Subscribe<fsmsg::view_ready_t>(kViewReady, [this](const fsmsg::view_ready_t& ready) {
    ++views_;
    status_ = Recorder::STATUS_STOPPED;
    fsmsg::view_captured_t captured{};
    captured.part = ready.part;
    captured.view = ready.view;
    captured.attempt = ready.attempt;
    captured.status = fsmsg::view_captured_t::STATUS_CAPTURED;
    EXPECT_TRUE(world_.Publish(kViewCaptured, captured).ok());
  });
  status_ = Recorder::STATUS_RECORDING;
  ASSERT_TRUE(network_.RunUntilTrue([this] { return scans_.size() == 2; }, 120 * kSecondUs));
  EXPECT_EQ(scans_[0].reason, "");
  EXPECT_EQ(scans_[0].views_captured, scans_[0].views_expected);
  EXPECT_THAT(scans_[1].reason, HasSubstr("the disk is full"));
  EXPECT_EQ(scans_[1].views_captured, 0);
}

TEST_F(RobotRecordingTest, WorksAgainWhenTheRecorderDoes) {
  status_ = Recorder::STATUS_STOPPED;
  ASSERT_TRUE(network_.RunUntilTrue([this] { return scans_.size() == 1; }, 60 * kSecondUs));
  status_ = Recorder::STATUS_RECORDING;
  ASSERT_TRUE(network_.RunUntilTrue([this] { return views_ > 0; }, 120 * kSecondUs));
}

}  // namespace
}  // namespace forgescan
