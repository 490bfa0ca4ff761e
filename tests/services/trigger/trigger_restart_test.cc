// A microcontroller that starts again without being missed: no view may go on, no time may be wrong.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "services/trigger/trigger_machine.h"

namespace forgescan {
namespace {

using testing::HasSubstr;

constexpr std::int64_t kStatusPeriodUs = 100'000;

class TriggerRestartTest : public testing::Test {
 protected:
  TriggerRestartTest() { machine_.OnLink(true, now_us_); }
  TriggerMachine::Actions Status(std::int64_t device_us) {
    now_us_ += kStatusPeriodUs;
    return machine_.OnStatus({.utime = now_us_,
                              .seq_echo = seq_,
                              .state = {},
                              .pulses_done = 0,
                              .device_time_us = static_cast<std::uint32_t>(device_us)});
  }
  // One pulse of a view that is taken as fired.
  ExposureRecord Fire(std::uint16_t pulse, std::int64_t device_us) {
    for (const auto& action : machine_.OnViewReady({now_us_, 1, 0, 0}, now_us_)) {
      seq_ = std::get<TriggerCommand>(action).seq;
    }
    const auto actions = machine_.OnPulse({.utime = now_us_,
                                           .seq_low = static_cast<std::uint8_t>(seq_ & 3),
                                           .right = false,
                                           .pattern = 0,
                                           .pulse = pulse,
                                           .exposure_us = 12'000,
                                           .device_time_us = static_cast<std::uint32_t>(device_us)});
    EXPECT_EQ(actions.size(), 1U);
    return std::get<ExposureRecord>(actions.at(0));
  }

  TriggerMachine machine_{TriggerConfig{}};
  std::uint16_t seq_ = 0;
  std::int64_t now_us_ = 10'000'000'000;
};

// Up for 20 minutes, and for an hour, where 32 bits no longer tell back from forth.
TEST_F(TriggerRestartTest, IsNoticedByItsClockAndVoidsTheView) {
  for (const std::int64_t uptime_us : {1'200'000'000LL, 3'600'000'000LL}) {
    for (int i = 0; i < 10; ++i) {
      EXPECT_TRUE(Status(uptime_us + i * kStatusPeriodUs).empty());
    }
    const ExposureRecord before = Fire(900, uptime_us + 900'000);
    EXPECT_EQ(before.pulse, 900);
    const auto actions = Status(50'000);
    ASSERT_EQ(actions.size(), 2U);
    EXPECT_THAT(std::get<ViewOutcome>(actions[0]).reason, HasSubstr("started again"));
    EXPECT_FALSE(std::get<ViewOutcome>(actions[0]).captured);
    EXPECT_EQ(machine_.phase(), TriggerPhase::kIdle);
    EXPECT_TRUE(Status(150'000).empty());
    const ExposureRecord after = Fire(1, 150'000);
    EXPECT_EQ(after.pulse, 1);
    EXPECT_EQ(after.device_time_us, 150'000);
    EXPECT_NEAR(static_cast<double>(after.utime), static_cast<double>(now_us_), 1);  // us
    machine_.OnLink(false, now_us_);
    machine_.OnLink(true, now_us_);
  }
}

TEST_F(TriggerRestartTest, AClockThatWrapsOrAStatusThatComesLateIsNone) {
  std::int64_t device_us = 0xFFFF'FFFFLL - 250'000;
  for (int i = 0; i < 10; ++i, device_us += kStatusPeriodUs) {
    EXPECT_TRUE(Status(device_us).empty());
  }
  now_us_ += 3'000'000;  // this one waited
  EXPECT_TRUE(Status(device_us).empty());
  now_us_ -= 3'000'000;
  EXPECT_TRUE(Status(device_us + kStatusPeriodUs).empty());
}

}  // namespace
}  // namespace forgescan
