#include "services/trigger/trigger_machine.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "drivers/trigger/trigger_sim.h"

namespace forgescan {
namespace {

using testing::HasSubstr;

// The machine on the simulated microcontroller, 1 ms a step.
class Bench {
 public:
  explicit Bench(const TriggerSimConfig& sim = {}) : device(sim) {
    device.SetHandler([this](const TriggerEvent& event) {
      if (const auto* link = std::get_if<DeviceLink>(&event)) {
        Do(machine.OnLink(link->up, now_us));
      } else if (const auto* fault = std::get_if<DeviceFault>(&event)) {
        Do(machine.OnFault(*fault, now_us));
      } else if (const auto* status = std::get_if<TriggerStatus>(&event)) {
        Do(machine.OnStatus(*status));
      } else {
        Do(machine.OnPulse(std::get<TriggerPulse>(event)));
      }
    });
  }

  void Do(const TriggerMachine::Actions& actions) {
    for (const TriggerAction& action : actions) {
      if (const auto* command = std::get_if<TriggerCommand>(&action)) {
        commands.push_back(*command);
        EXPECT_TRUE(device.Send(*command).ok());
      } else if (const auto* record = std::get_if<ExposureRecord>(&action)) {
        records.push_back(*record);
      } else if (const auto* outcome = std::get_if<ViewOutcome>(&action)) {
        outcomes.push_back(*outcome);
      } else {
        notes.push_back(std::get<TriggerNote>(action).text);
      }
    }
  }
  void RunFor(std::int64_t duration_us) {
    for (const std::int64_t end_us = now_us + duration_us; now_us < end_us; now_us += 1000) {
      device.Step(now_us);
      Do(machine.OnTick(now_us));
    }
  }
  void View(int view) { Do(machine.OnViewReady({now_us, 1, view, 0}, now_us)); }

  TriggerSim device;
  TriggerMachine machine{TriggerConfig{}};
  std::vector<TriggerCommand> commands;
  std::vector<ExposureRecord> records;
  std::vector<ViewOutcome> outcomes;
  std::vector<std::string> notes;
  std::int64_t now_us = 1'000'000;
};

TEST(TriggerMachine, Starts) {
  Bench bench;
  EXPECT_EQ(bench.machine.phase(), TriggerPhase::kOffline);
  bench.RunFor(10'000);
  EXPECT_EQ(bench.machine.phase(), TriggerPhase::kIdle);
}

TEST(TriggerMachine, CapturesAViewWithOneRecordAPulseOnStationTime) {
  Bench bench({.device_time_at_start_us = 0xFFFFFFFFU - 300'000});  // its clock wraps during the view
  std::vector<std::int64_t> edges_us;
  bench.device.SetEdgeHandler([&](const TriggerSim::Edge& edge) { edges_us.push_back(edge.utime); });
  bench.RunFor(100'000);
  bench.View(0);
  bench.RunFor(1'500'000);
  bench.View(1);
  bench.RunFor(1'500'000);
  ASSERT_EQ(bench.outcomes.size(), 2U);
  EXPECT_TRUE(bench.outcomes[0].captured);
  ASSERT_EQ(bench.records.size(), 32U);
  for (std::size_t i = 0; i < bench.records.size(); ++i) {
    EXPECT_EQ(bench.records[i].utime, edges_us[i]);
    EXPECT_EQ(bench.records[i].right, i % 2 == 1);
    EXPECT_EQ(bench.records[i].pulse, static_cast<int>(i / 2) + 1);
    if (i > 0) {
      EXPECT_GT(bench.records[i].device_time_us, bench.records[i - 1].device_time_us);
    }
  }
  EXPECT_TRUE(bench.notes.empty());
}

TEST(TriggerMachine, AMissingPulseOrRecordMakesTheViewVoidAndTheNextOneWorks) {
  for (const TriggerSimFaults& faults :
       {TriggerSimFaults{.lose_pulse_of_view = 3}, TriggerSimFaults{.lose_record = 3}}) {
    Bench bench;
    bench.device.SetFaults(faults);
    bench.RunFor(100'000);
    bench.View(0);
    bench.RunFor(2'000'000);
    ASSERT_EQ(bench.outcomes.size(), 1U);
    EXPECT_FALSE(bench.outcomes[0].captured);
    EXPECT_EQ(bench.outcomes[0].pulses[1], 7);
    EXPECT_THAT(bench.outcomes[0].reason, HasSubstr("missing"));
    bench.device.SetFaults({});
    bench.View(0);
    bench.RunFor(2'000'000);
    EXPECT_TRUE(bench.outcomes.back().captured);
  }
}

TEST(TriggerMachine, ResendsTheSameCommandThenGivesUp) {
  Bench bench;
  bench.RunFor(100'000);
  bench.device.SetFaults({.deaf = true});
  bench.View(0);
  bench.RunFor(1'000'000);
  ASSERT_GE(bench.commands.size(), 3U);
  EXPECT_EQ(bench.commands[0], bench.commands[1]);
  EXPECT_EQ(bench.commands[0], bench.commands[2]);
  ASSERT_EQ(bench.outcomes.size(), 1U);
  EXPECT_THAT(bench.outcomes[0].reason, HasSubstr("did not echo"));
}

TEST(TriggerMachine, RepeatedRecordsCountOnce) {
  Bench bench;
  bench.device.SetFaults({.repeats_records = true});
  bench.RunFor(100'000);
  bench.View(0);
  bench.RunFor(1'500'000);
  EXPECT_EQ(bench.records.size(), 16U);
  EXPECT_EQ(bench.notes.size(), 16U);
  EXPECT_TRUE(bench.outcomes.at(0).captured);
}

TEST(TriggerMachine, PositionLostInterlockAndLinkLostMakeTheViewVoid) {
  const std::vector<std::function<TriggerMachine::Actions(Bench&)>> events = {
      [](Bench& b) { return b.machine.OnPosition(false, b.now_us); },
      [](Bench& b) { return b.machine.OnInterlock(true, "hot", b.now_us); },
      [](Bench& b) { return b.machine.OnLink(false, b.now_us); }};
  for (const auto& event : events) {
    Bench bench;
    bench.RunFor(100'000);
    bench.View(0);
    bench.RunFor(200'000);
    bench.Do(event(bench));
    ASSERT_EQ(bench.outcomes.size(), 1U);
    EXPECT_FALSE(bench.outcomes[0].captured);
    EXPECT_FALSE(bench.outcomes[0].reason.empty());
    const std::size_t before = bench.records.size();
    bench.RunFor(1'000'000);
    EXPECT_EQ(bench.records.size(), before);  // the rest of the pulses belongs to nothing
  }
}

TEST(TriggerMachine, IllegalEventsAreAnsweredAndChangeNothing) {
  Bench bench;
  bench.View(0);  // offline
  EXPECT_EQ(bench.machine.phase(), TriggerPhase::kOffline);
  bench.RunFor(100'000);
  bench.View(1);
  bench.View(2);  // the first one is under way
  ASSERT_EQ(bench.outcomes.size(), 2U);
  EXPECT_EQ(bench.outcomes[1].view.view, 2);
  bench.RunFor(1'500'000);
  EXPECT_TRUE(bench.outcomes.at(2).captured);
  bench.Do(bench.machine.OnPulse({}));  // of no view
  EXPECT_EQ(bench.notes.size(), 1U);
  bench.Do(bench.machine.OnInterlock(true, "hot", bench.now_us));
  bench.View(3);
  EXPECT_THAT(bench.outcomes.back().reason, HasSubstr("interlock"));
}

TEST(TriggerPlan, HoldsOneTransferInEachHalf) {
  const auto plan = PlanTrigger(TriggerConfig{});
  ASSERT_TRUE(plan.ok());
  EXPECT_EQ(plan->transfer_us, 42'219);  // 5 013 504 bytes at 950 Mbit/s
  EXPECT_EQ(plan->period_us, 2 * (42'219 + 1'000));
  TriggerConfig slow;
  slow.exposure_us = 40'950;
  slow.link_mbit_s = 10'000;
  EXPECT_EQ(PlanTrigger(slow)->period_us, 2 * (40'950 + 1'000));
}

TEST(TriggerPlan, RefusesAPeriodBelowTheBudget) {
  TriggerConfig config;
  config.period_us = 80'000;
  const auto plan = PlanTrigger(config);
  ASSERT_FALSE(plan.ok());
  EXPECT_THAT(plan.error().message, HasSubstr("86438"));
  EXPECT_FALSE(config.Check().ok());
}

TEST(DeviceClock, IsOffByTheShortestDelayOnly) {
  DeviceClock clock;
  EXPECT_FALSE(clock.Unwrap(5));
  for (int i = 0; i < 200; ++i) {  // every tenth frame is on time, the others up to 2 ms late
    const std::uint32_t device_us = 0xFFFF0000U + static_cast<std::uint32_t>(i) * 100'000;
    clock.OnStatus(device_us, 10'000'000 + i * 100'000 + 250 * (i % 9));
  }
  const auto unwrapped = clock.Unwrap(0xFFFF0000U + 199 * 100'000U);
  ASSERT_TRUE(unwrapped);
  EXPECT_EQ(*unwrapped, 0xFFFF0000LL + 199 * 100'000LL);
  EXPECT_EQ(clock.ToStation(*unwrapped), 10'000'000 + 199 * 100'000);
}

}  // namespace
}  // namespace forgescan
