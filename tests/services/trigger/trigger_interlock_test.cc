// Which states of the cooling let the trigger fire.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "drivers/trigger/trigger_sim.h"
#include "services/common/bus/sim_bus.h"
#include "services/trigger/trigger_service.h"

namespace forgescan {
namespace {

using testing::HasSubstr;
using Cooling = fsmsg::cooling_state_t;

constexpr std::int64_t kSecondUs = 1'000'000;

class TriggerInterlockTest : public testing::Test {
 protected:
  TriggerInterlockTest() {
    world_.Subscribe<fsmsg::view_captured_t>(kViewCaptured, [this](const auto& m) { views_.push_back(m); });
    network_.RunFor(kSecondUs);
  }
  fsmsg::view_captured_t FireAfter(std::int8_t interlock) {
    Cooling state{};
    state.utime = network_.NowUs();
    state.interlock = interlock;
    state.reason = "a reason";
    EXPECT_TRUE(PublishState(world_.bus(), kCoolingState, state).ok());
    network_.RunFor(kSecondUs);
    fsmsg::view_ready_t ready{};
    ready.utime = network_.NowUs();
    ready.part = 1;
    EXPECT_TRUE(world_.Publish(kViewReady, ready).ok());
    views_.clear();
    network_.RunFor(3 * kSecondUs);
    EXPECT_EQ(views_.size(), 1U);
    return views_.empty() ? fsmsg::view_captured_t{} : views_.front();
  }

  SimNetwork network_;
  StreamHub hub_{network_.AddNode(), "trigger"};
  StreamHub world_{network_.AddNode(), "world"};
  ServiceMonitor monitor_{hub_, "trigger", ""};
  TriggerSim device_;
  TriggerService service_{hub_, monitor_, device_, TriggerConfig{}};
  std::vector<fsmsg::view_captured_t> views_;
};

TEST_F(TriggerInterlockTest, FiresWhenClearOrWarnedOnly) {
  constexpr auto kCaptured = fsmsg::view_captured_t::STATUS_CAPTURED;
  EXPECT_EQ(FireAfter(Cooling::INTERLOCK_CLEAR).status, kCaptured);
  EXPECT_EQ(FireAfter(Cooling::INTERLOCK_WARN).status, kCaptured);
  for (const std::int8_t stop : {Cooling::INTERLOCK_UNKNOWN, Cooling::INTERLOCK_STOP_INSPECTION,
                                 Cooling::INTERLOCK_POWER_OFF, std::int8_t{9}}) {
    const auto view = FireAfter(stop);
    EXPECT_EQ(view.status, fsmsg::view_captured_t::STATUS_VOID) << int{stop};
    EXPECT_THAT(view.reason, HasSubstr("cooling interlock"));
  }
  EXPECT_EQ(FireAfter(Cooling::INTERLOCK_CLEAR).status, kCaptured);
}

}  // namespace
}  // namespace forgescan
