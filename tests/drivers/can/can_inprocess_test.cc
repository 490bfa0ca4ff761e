#include "drivers/can/can_inprocess.h"

#include <gtest/gtest.h>

namespace forgescan {
namespace {

struct Heard {
  std::vector<std::uint32_t> ids;
  std::vector<std::int64_t> times_us;
  std::uint64_t errors = 0;
};

// Sends frames 0..99 one millisecond apart and says what the other station heard.
Heard HundredFrames(const CanFaults& faults) {
  InProcessCan wire(faults);
  auto sender = wire.Attach();
  auto receiver = wire.Attach();
  Heard heard;
  receiver->AddHandler([&](const CanFrame& frame) {
    heard.ids.push_back(frame.id);
    heard.times_us.push_back(frame.utime);
  });
  for (std::uint32_t id = 0; id < 100; ++id) {
    wire.StepTo(1000 * id);
    EXPECT_TRUE(sender->Send({.id = id}).ok());
    EXPECT_TRUE(receiver->Drain().ok());
  }
  wire.StepTo(1'000'000);
  EXPECT_TRUE(receiver->Drain().ok());
  return heard;
}

TEST(InProcessCan, DeliversAfterTheLatencyAndNotBefore) {
  const Heard heard = HundredFrames({});
  ASSERT_EQ(heard.ids.size(), 100U);
  EXPECT_EQ(heard.times_us[0], 250);
  EXPECT_EQ(heard.times_us[99], 99'250);
}

TEST(InProcessCan, LosesDuplicatesAndReordersAsTold) {
  EXPECT_TRUE(HundredFrames({.loss = 1}).ids.empty());
  EXPECT_EQ(HundredFrames({.duplicate = 1}).ids.size(), 200U);
  const Heard late = HundredFrames({.reorder = 0.5, .max_delay_us = 5000});
  EXPECT_EQ(late.ids.size(), 100U);
  EXPECT_FALSE(std::is_sorted(late.ids.begin(), late.ids.end()));
  EXPECT_TRUE(std::is_sorted(late.times_us.begin(), late.times_us.end()));
}

TEST(InProcessCan, TheSameSeedFailsTheSameWay) {
  const CanFaults faults{.loss = 0.2, .duplicate = 0.2, .reorder = 0.2, .max_delay_us = 3000, .seed = 7};
  EXPECT_EQ(HundredFrames(faults).ids, HundredFrames(faults).ids);
  CanFaults other = faults;
  other.seed = 8;
  EXPECT_NE(HundredFrames(faults).ids, HundredFrames(other).ids);
}

TEST(InProcessCan, BusOffIsHeardRefusesToSendAndEnds) {
  InProcessCan wire;
  auto a = wire.Attach();
  auto b = wire.Attach();
  ASSERT_TRUE(a->Send({.id = 1}).ok());
  wire.SetBusOff(true);
  EXPECT_EQ(a->Send({.id = 2}).error().code, ErrorCode::kUnavailable);
  wire.StepTo(10'000);
  ASSERT_TRUE(b->Drain().ok());
  EXPECT_EQ(b->counters().received, 0U);  // the frame under way is lost
  EXPECT_EQ(b->counters().bus_offs, 1U);
  wire.SetBusOff(false);
  ASSERT_TRUE(a->Send({.id = 3}).ok());
  wire.StepTo(20'000);
  ASSERT_TRUE(b->Drain().ok());
  EXPECT_EQ(b->counters().received, 1U);
}

TEST(InProcessCan, ChecksItsFaults) {
  EXPECT_TRUE(CanFaults{}.Check().ok());
  EXPECT_FALSE(CanFaults{.loss = 1.1}.Check().ok());
  EXPECT_FALSE(CanFaults{.duplicate = std::numeric_limits<double>::quiet_NaN()}.Check().ok());
  EXPECT_FALSE(CanFaults{.max_delay_us = -1}.Check().ok());
}

}  // namespace
}  // namespace forgescan
