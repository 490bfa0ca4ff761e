#include "services/cooling/cooling_controller.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "drivers/cooling/cooling_sim.h"
#include "services/cooling/dew_point.h"

namespace forgescan {
namespace {

using testing::HasSubstr;

// The controller on the simulated unit, 100 ms a step, a command every 200 ms.
class Loop {
 public:
  explicit Loop(const CoolingSimConfig& plant = {}, const CoolingConfig& config = {})
      : unit(plant), controller(config) {
    unit.SetHandler([this](const CoolingEvent& event) {
      if (const auto* t = std::get_if<CoolingTemperatures>(&event)) {
        controller.OnTemperatures(
            {t->utime, t->inlet_degc, t->outlet_degc, t->ambient_degc, t->hot_side_degc});
      } else if (const auto* s = std::get_if<CoolingStatus>(&event)) {
        controller.OnUnit({s->utime, s->flow_lpm, s->pump_on, s->humidity_pct});
      }
    });
    controller.OnLink(true);
  }

  void RunFor(double seconds) {
    const std::int64_t end_us = now_us + static_cast<std::int64_t>(1e6 * seconds);
    for (; now_us < end_us; now_us += 100'000) {
      unit.Step(now_us);
      if (now_us % 200'000 == 0) {
        last = controller.Tick(now_us);
        EXPECT_TRUE(unit.Send({last.duty, last.pump_on, last.projector_off, last.sensor_power_off}).ok());
        EXPECT_GE(last.duty, 0);
        EXPECT_LE(last.duty, 1);
      }
      hottest_degc = std::max(hottest_degc, unit.inside_degc());
      in_band += unit.inside_degc() >= 30 && unit.inside_degc() <= 34 ? 1 : 0;
      ++samples;
    }
  }
  void Restart() { in_band = samples = 0, hottest_degc = 0; }

  CoolingSim unit;
  CoolingController controller;
  CoolingOutput last;
  std::int64_t now_us = 1'000'000;
  double hottest_degc = 0;
  int in_band = 0;
  int samples = 0;
};

TEST(CoolingController, Starts) {
  CoolingController controller{CoolingConfig{}};
  const CoolingOutput output = controller.Tick(1);
  EXPECT_EQ(output.interlock, Interlock::kUnknown);
  EXPECT_TRUE(output.pump_on);
}

TEST(CoolingController, HoldsTheBandOnAHeatLoadThatComesAndGoes) {
  Loop loop;
  for (int cycle = 0; cycle < 40; ++cycle) {
    if (cycle == 14) {
      loop.Restart();  // after 10 min
    }
    loop.unit.SetHeatLoad(60);
    loop.RunFor(27);  // the scan
    loop.unit.SetHeatLoad(0);
    loop.RunFor(18);
  }
  EXPECT_GE(loop.in_band, 0.99 * loop.samples);
  EXPECT_LE(loop.hottest_degc, 33.0);  // overshoot <= 1 K over the set-point of 32 degC
  EXPECT_EQ(loop.last.interlock, Interlock::kClear) << loop.last.reason;
}

TEST(CoolingController, RecoversFromSaturationWithoutWindup) {
  Loop loop;
  loop.unit.SetHeatLoad(140);  // more than the cooler can take: the inside rises to about 37 degC
  loop.RunFor(600);
  EXPECT_NEAR(loop.last.duty, 1, 0.01);
  loop.unit.SetHeatLoad(30);
  double left_s = 0;
  while (loop.last.duty > 0.98 && left_s < 1000) {
    loop.RunFor(1);
    ++left_s;
  }
  loop.RunFor(60);
  EXPECT_GE(loop.unit.inside_degc(), 30);  // back in the band of 30..34 degC within 60 s ...
  EXPECT_LE(loop.unit.inside_degc(), 34);  // ... on both sides
}

TEST(CoolingController, DutySlewsNoFasterThanAllowed) {
  Loop loop({.start_inside_degc = 35});
  double before = 0;
  for (int i = 0; i < 50; ++i) {
    loop.RunFor(0.2);
    EXPECT_LE(std::abs(loop.last.duty - before), 0.05 * 0.2 + 1e-9);  // 5 %/s
    before = loop.last.duty;
  }
}

TEST(CoolingController, ManualAndBackIsBumpless) {
  Loop loop;
  loop.unit.SetHeatLoad(40);
  loop.RunFor(600);
  const double automatic = loop.last.duty;
  loop.controller.SetManual(automatic);
  loop.RunFor(20);
  loop.controller.SetManual(std::nullopt);
  loop.RunFor(0.4);
  EXPECT_NEAR(loop.last.duty, automatic, 0.02);  // two slew steps
}

TEST(CoolingController, GoesOnWithOneThermometerAndWarns) {
  for (const bool inlet : {true, false}) {
    Loop loop;
    loop.unit.SetHeatLoad(30);
    loop.RunFor(600);
    loop.unit.SetFaults({.inlet_dead = inlet, .outlet_dead = !inlet});
    loop.RunFor(300);
    EXPECT_EQ(loop.last.interlock, Interlock::kWarn);
    EXPECT_THAT(loop.last.reason, HasSubstr(inlet ? "inlet thermometer" : "outlet thermometer"));
    EXPECT_NEAR(loop.unit.inside_degc(), 32, 1.5);  // the difference of the two is only known from before
  }
}

TEST(CoolingController, StopsTheInspectionWhenBlindForAMinuteAndRecovers) {
  Loop loop;
  loop.RunFor(100);
  loop.unit.SetFaults({.inlet_dead = true, .outlet_dead = true});
  loop.RunFor(50);
  EXPECT_EQ(loop.last.interlock, Interlock::kWarn);
  EXPECT_NEAR(loop.last.duty, 0.3, 0.01);  // the safe duty
  loop.RunFor(15);
  EXPECT_EQ(loop.last.interlock, Interlock::kStopInspection);
  EXPECT_TRUE(loop.last.projector_off);
  loop.unit.SetFaults({});
  loop.RunFor(10);
  EXPECT_EQ(loop.last.interlock, Interlock::kClear) << loop.last.reason;
}

TEST(CoolingController, DistrustsAJumpAndAFrozenThermometer) {
  Loop loop;
  loop.RunFor(100);
  loop.unit.SetFaults({.outlet_jump_k = 8});
  loop.RunFor(0.4);
  EXPECT_THAT(loop.last.reason, HasSubstr("jumped"));
  Loop frozen;
  frozen.unit.SetFaults({.outlet_frozen = true});
  frozen.RunFor(300);
  for (int i = 0; i < 4; ++i) {  // the duty moves, the thermometer does not
    frozen.controller.SetManual(i % 2);
    frozen.RunFor(100);
  }
  EXPECT_THAT(frozen.last.reason, HasSubstr("has not moved"));
}

TEST(CoolingController, SilentTemperaturesAreStaleAfterASecond) {
  Loop loop;
  loop.RunFor(100);
  loop.unit.SetFaults({.silent = true});
  loop.RunFor(2);
  EXPECT_EQ(loop.last.interlock, Interlock::kWarn);
  EXPECT_THAT(loop.last.reason, HasSubstr("stale"));
}

TEST(CoolingController, NoFlowSwitchesTheCoolerOffWithinTwoSeconds) {
  Loop loop;
  loop.unit.SetHeatLoad(60);
  loop.RunFor(300);
  ASSERT_GT(loop.last.duty, 0.1);
  loop.unit.SetFaults({.pump_dead = true});
  loop.RunFor(2);
  EXPECT_EQ(loop.last.duty, 0);
  EXPECT_THAT(loop.last.reason, HasSubstr("air flow"));
}

TEST(CoolingController, InterlocksRiseWithTheTemperatureAndFallWithHysteresis) {
  CoolingController controller{CoolingConfig{}};
  controller.OnLink(true);
  std::int64_t now_us = 0;
  const auto at = [&](double inside_degc) {
    for (int i = 0; i < 30; ++i) {  // a new controller input 3 s long: a jump is distrusted for 1 s
      now_us += 100'000;
      controller.OnUnit({now_us, 600, true, 50});
      controller.OnTemperatures({now_us, inside_degc - 4, inside_degc, 35, 40});
      controller.Tick(now_us);
    }
    return controller.Tick(now_us).interlock;
  };
  EXPECT_EQ(at(35), Interlock::kClear);
  EXPECT_EQ(at(36.5), Interlock::kWarn);
  EXPECT_EQ(at(35), Interlock::kWarn);
  EXPECT_EQ(at(33.9), Interlock::kClear);
  EXPECT_EQ(at(40.5), Interlock::kStopInspection);
  EXPECT_EQ(at(38.5), Interlock::kStopInspection);
  EXPECT_EQ(at(37.5), Interlock::kWarn);
  EXPECT_EQ(at(45.5), Interlock::kPowerOff);
  EXPECT_EQ(at(42.5), Interlock::kStopInspection);
}

TEST(CoolingController, HumidAirLimitsTheDuty) {
  CoolingSimConfig humid;
  humid.humidity_pct = 80;
  Loop loop(humid);
  loop.unit.SetHeatLoad(100);
  loop.RunFor(600);
  // 30 degC at 80 %: dew point 26.2 degC, so the air may be cooled by 0.8 K only: duty 1 - sqrt(1 - 0.1) =
  // 0.05.
  EXPECT_LT(loop.last.duty, 0.07);
}

TEST(DewPoint, AgreesWithTheTable) {
  EXPECT_NEAR(*DewPoint_degc(30, 60), 21.4, 0.05);  // degC, one digit of the table
  EXPECT_NEAR(*DewPoint_degc(20, 100), 20, 1e-9);
  EXPECT_FALSE(DewPoint_degc(30, 0).ok());
  EXPECT_FALSE(DewPoint_degc(std::nan(""), 50).ok());
}

TEST(CoolingConfig, ChecksItself) {
  EXPECT_TRUE(CoolingConfig{}.Check().ok());
  CoolingConfig config;
  config.stop_degc = 50;
  EXPECT_FALSE(config.Check().ok());
  config = {};
  config.safe_duty = std::nan("");
  EXPECT_FALSE(config.Check().ok());
}

}  // namespace
}  // namespace forgescan
