// Which states of the cooling let the robot take up a part; silence is none of them.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "drivers/line/line_sim.h"
#include "drivers/robot/robot_sim.h"
#include "services/common/bus/sim_bus.h"
#include "services/robot/robot_service.h"

namespace forgescan {
namespace {

using testing::HasSubstr;
using Cooling = fsmsg::cooling_state_t;

constexpr std::int64_t kSecondUs = 1'000'000;

class RobotInterlockTest : public testing::Test {
 protected:
  RobotInterlockTest() {
    world_.Subscribe<fsmsg::scan_complete_t>(kScanComplete, [this](const auto& m) { scans_.push_back(m); });
    world_.Subscribe<fsmsg::view_ready_t>(kViewReady, [this](const auto&) { ++views_; });
  }
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
  RobotService service_{hub_, monitor_, {robot_, line_}, RobotConfig{}};
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

}  // namespace
}  // namespace forgescan
