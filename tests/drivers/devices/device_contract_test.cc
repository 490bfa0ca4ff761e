// What every device keeps, whether its simulation is called directly or sits behind the CAN bus with the real
// driver in front.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/drivers/devices/device_bench.h"

namespace forgescan {
namespace {

class DeviceContract : public testing::TestWithParam<bool> {};

TEST_P(DeviceContract, RobotStartsAtHomeAndTellsItsPath) {
  RobotBench bench(GetParam(), RobotSimConfig{});
  bench.RunFor(1'000'000);
  EXPECT_EQ(bench.Last<DeviceLink>(), DeviceLink{true});
  EXPECT_EQ(bench.Last<RobotPath>(), (RobotPath{10, 0x1234ABCD, 200, 8000}));
  EXPECT_EQ(bench.Last<RobotStatus>().state, RobotState::kHome);
  EXPECT_EQ(bench.Last<RobotMotion>().body_degc, 35.0);
}

TEST_P(DeviceContract, RobotGoesToAViewSettlesAndHolds) {
  RobotBench bench(GetParam(), RobotSimConfig{});
  bench.RunFor(1'000'000);
  ASSERT_TRUE(bench.device().Send({1, RobotOrder::kSelectPath, 1, 0}).ok());
  bench.RunFor(10'000);
  ASSERT_TRUE(bench.device().Send({2, RobotOrder::kGoView, 1, 0}).ok());
  bench.RunFor(1'400'000);
  EXPECT_EQ(bench.Last<RobotStatus>().state, RobotState::kMoving);
  bench.RunFor(150'000);
  EXPECT_EQ(bench.Last<RobotStatus>().state, RobotState::kSettling);
  bench.RunFor(300'000);
  EXPECT_TRUE(bench.Last<RobotStatus>().in_position);
  EXPECT_EQ(bench.Last<RobotStatus>().seq_echo, 2);
}

TEST_P(DeviceContract, RobotCarriesOutARepeatedSeqOnce) {
  RobotBench bench(GetParam(), RobotSimConfig{});
  bench.RunFor(1'000'000);
  for (int repeat = 0; repeat < 3; ++repeat) {
    ASSERT_TRUE(bench.device().Send({1, RobotOrder::kSelectPath, 1, 0}).ok());
    bench.RunFor(10'000);
  }
  EXPECT_EQ(bench.simulation().executed(), 1);
}

TEST_P(DeviceContract, RobotRefusesAViewOutOfOrderAndStillWorks) {
  RobotBench bench(GetParam(), RobotSimConfig{});
  bench.RunFor(1'000'000);
  ASSERT_TRUE(bench.device().Send({1, RobotOrder::kSelectPath, 1, 0}).ok());
  bench.RunFor(10'000);
  ASSERT_TRUE(bench.device().Send({2, RobotOrder::kGoView, 1, 3}).ok());
  bench.RunFor(10'000);
  EXPECT_EQ(bench.Last<DeviceFault>(), (DeviceFault{0xFF01, 2 | 3U << 16}));
  EXPECT_EQ(bench.Last<RobotStatus>().seq_echo, 1);
  ASSERT_TRUE(bench.device().Send({3, RobotOrder::kGoView, 1, 0}).ok());
  bench.RunFor(2'000'000);
  EXPECT_TRUE(bench.Last<RobotStatus>().in_position);
}

TEST_P(DeviceContract, RobotProtectiveStopIsAFaultUntilReset) {
  RobotBench bench(GetParam(), RobotSimConfig{});
  bench.RunFor(1'000'000);
  bench.simulation().SetFaults({.protective_stop = true});
  bench.RunFor(10'000);
  EXPECT_EQ(bench.Last<RobotStatus>().state, RobotState::kFault);
  EXPECT_TRUE(bench.Last<RobotStatus>().protective_stop);
  bench.simulation().SetFaults({});
  ASSERT_TRUE(bench.device().Send({1, RobotOrder::kResetFault, 1, 0}).ok());
  bench.RunFor(10'000);
  EXPECT_EQ(bench.Last<RobotStatus>().state, RobotState::kIdle);
  EXPECT_EQ(bench.Last<DeviceFault>().code, 0);
}

TEST_P(DeviceContract, TriggerFiresTheCamerasInTurn) {
  TriggerBench bench(GetParam(), TriggerSimConfig{});
  std::vector<TriggerSim::Edge> edges;
  bench.simulation().SetEdgeHandler([&](const TriggerSim::Edge& edge) { edges.push_back(edge); });
  bench.RunFor(1'000'000);
  ASSERT_TRUE(bench.device().Send({7, TriggerMode::kFire, 4, 8, 100'000, 20'000, 0, 2}).ok());
  bench.RunFor(1'000'000);
  ASSERT_EQ(edges.size(), 16U);
  for (std::size_t i = 0; i < edges.size(); ++i) {
    EXPECT_EQ(edges[i].right, i % 2 == 1);
    EXPECT_EQ(edges[i].pattern, i / 2);
    EXPECT_EQ(edges[i].utime - edges[0].utime, static_cast<std::int64_t>(i) * 50'000);  // half a period
  }
  const auto pulses = bench.All<TriggerPulse>();
  ASSERT_EQ(pulses.size(), 16U);
  EXPECT_EQ(pulses[15].pulse, 8);
  EXPECT_EQ(pulses[15].seq_low, 3);
  EXPECT_EQ(pulses[15].exposure_us, 20'000);
  EXPECT_EQ(bench.Last<TriggerStatus>().state, TriggerState::kDone);
}

TEST_P(DeviceContract, TriggerRefusesAPeriodShorterThanTwoExposures) {
  TriggerBench bench(GetParam(), TriggerSimConfig{});
  bench.RunFor(1'000'000);
  ASSERT_TRUE(bench.device().Send({1, TriggerMode::kFire, 0, 8, 30'000, 20'000, 0, 2}).ok());
  bench.RunFor(100'000);
  EXPECT_EQ(bench.Last<DeviceFault>(), (DeviceFault{0xFF00, 1}));
  EXPECT_TRUE(bench.All<TriggerPulse>().empty());
}

TEST_P(DeviceContract, TriggerClockWraps) {
  TriggerBench bench(GetParam(), TriggerSimConfig{.device_time_at_start_us = 0xFFFFFFFFU - 500'000});
  bench.RunFor(1'500'000);
  EXPECT_LT(bench.Last<TriggerStatus>().device_time_us, 1'000'000U);
}

TEST_P(DeviceContract, CoolingReportsTenTimesASecondAndCools) {
  CoolingBench bench(GetParam(), CoolingSimConfig{});
  bench.RunFor(1'000'000);
  const std::size_t before = bench.All<CoolingTemperatures>().size();
  for (int second = 0; second < 60; ++second) {
    ASSERT_TRUE(bench.device().Send({.duty = 1, .pump_on = true}).ok());
    bench.RunFor(500'000);
  }
  EXPECT_NEAR(static_cast<double>(bench.All<CoolingTemperatures>().size() - before), 300,
              3);  // 30 s at 10 Hz
  EXPECT_LT(bench.Last<CoolingTemperatures>().inlet_degc, 26);
  EXPECT_EQ(bench.Last<CoolingStatus>().state, CoolingUnitState::kRunning);
}

TEST_P(DeviceContract, CoolingFallsBackWithoutCommands) {
  CoolingBench bench(GetParam(), CoolingSimConfig{});
  bench.RunFor(1'000'000);
  ASSERT_TRUE(bench.device().Send({.duty = 1, .pump_on = true}).ok());
  bench.RunFor(1'500'000);
  EXPECT_EQ(bench.Last<CoolingStatus>().state, CoolingUnitState::kSafe);
  EXPECT_NEAR(bench.Last<CoolingStatus>().duty, 0.3, 1e-4);  // 0.01 % on the wire
  EXPECT_EQ(bench.Last<DeviceFault>().code, 0x8250);
}

TEST_P(DeviceContract, CoolingDeadThermometerIsNaN) {
  CoolingBench bench(GetParam(), CoolingSimConfig{});
  bench.simulation().SetFaults({.inlet_dead = true});
  bench.RunFor(1'000'000);
  EXPECT_TRUE(std::isnan(bench.Last<CoolingTemperatures>().inlet_degc));
  EXPECT_FALSE(std::isnan(bench.Last<CoolingTemperatures>().outlet_degc));
}

TEST_P(DeviceContract, CoolingRefusesADutyOutOfRange) {
  CoolingBench bench(GetParam(), CoolingSimConfig{});
  bench.RunFor(1'000'000);
  for (const double duty : {-0.1, 1.1, std::nan("")}) {
    EXPECT_EQ(bench.device().Send({.duty = duty}).error().code, ErrorCode::kInvalidArgument);
  }
}

TEST_P(DeviceContract, LineBringsPartsAndMeasuresThem) {
  LineBench bench(GetParam(), LineSimConfig{.takt_us = 2'000'000, .dwell_us = 1'500'000, .parts = 2});
  bench.simulation().SetTemperature([](std::uint32_t part, std::int64_t) { return 900.0 + part; });
  bench.RunFor(5'000'000);
  std::vector<std::uint32_t> in_place;
  for (const LinePart& part : bench.All<LinePart>()) {
    if (part.in_place && (in_place.empty() || in_place.back() != part.part)) {
      in_place.push_back(part.part);
    }
  }
  EXPECT_THAT(in_place, testing::ElementsAre(1, 2));
  EXPECT_FALSE(bench.Last<LinePart>().in_place);
  double hottest = 0;
  for (const LinePyrometer& reading : bench.All<LinePyrometer>()) {
    hottest = reading.valid ? std::max(hottest, reading.part_degc) : hottest;
  }
  EXPECT_EQ(hottest, 902.0);
}

TEST_P(DeviceContract, LineEchoesTheSortCommandAndMovesOnce) {
  LineBench bench(GetParam(), LineSimConfig{});
  bench.RunFor(1'000'000);
  for (int repeat = 0; repeat < 2; ++repeat) {
    ASSERT_TRUE(bench.device().Send({7, LineVerdict::kNotOk, 5}).ok());
    bench.RunFor(50'000);
  }
  bench.RunFor(500'000);
  const LineSortEcho echo = bench.Last<LineSortEcho>();
  EXPECT_EQ(echo.part, 7U);
  EXPECT_EQ(echo.verdict, LineVerdict::kNotOk);
  EXPECT_EQ(echo.gate, GateState::kDone);
  EXPECT_EQ(echo.seq_echo, 5);
  EXPECT_EQ(bench.simulation().sorted().size(), 1U);
  bench.simulation().SetFaults({.stuck_valve = true});
  ASSERT_TRUE(bench.device().Send({8, LineVerdict::kOk, 6}).ok());
  bench.RunFor(500'000);
  EXPECT_EQ(bench.Last<LineSortEcho>().gate, GateState::kStuck);
}

std::string WireName(const testing::TestParamInfo<bool>& param) { return param.param ? "OverCan" : "Direct"; }
INSTANTIATE_TEST_SUITE_P(Wires, DeviceContract, testing::Bool(), WireName);

TEST(CanopenHost, LosesTheLinkWithTheHeartbeatAndFindsItAgain) {
  RobotBench bench(true, RobotSimConfig{});
  EXPECT_EQ(bench.device().Send({}).error().code, ErrorCode::kUnavailable);
  bench.RunFor(1'000'000);
  bench.node().SetFaults({.silent = true});
  bench.RunFor(500'000);
  EXPECT_EQ(bench.Last<DeviceLink>(), DeviceLink{false});
  EXPECT_EQ(bench.device().Send({}).error().code, ErrorCode::kUnavailable);
  bench.node().SetFaults({});
  bench.node().Restart();
  bench.RunFor(1'000'000);
  EXPECT_EQ(bench.Last<DeviceLink>(), DeviceLink{true});
  EXPECT_EQ(bench.All<RobotPath>().size(), 2U);
}

TEST(CanopenHost, SurvivesBusOff) {
  RobotBench bench(true, RobotSimConfig{});
  bench.RunFor(1'000'000);
  bench.wire().SetBusOff(true);
  bench.RunFor(1'000'000);
  EXPECT_EQ(bench.Last<DeviceLink>(), DeviceLink{false});
  bench.wire().SetBusOff(false);
  bench.RunFor(1'000'000);
  EXPECT_EQ(bench.Last<DeviceLink>(), DeviceLink{true});
}

TEST(CanopenHost, ComesUpOnALossyBus) {
  RobotBench bench(true, RobotSimConfig{});
  bench.wire().SetFaults({.loss = 0.3, .duplicate = 0.2, .reorder = 0.2, .max_delay_us = 20'000, .seed = 3});
  bench.RunFor(3'000'000);
  bench.wire().SetFaults({});
  bench.RunFor(1'000'000);
  EXPECT_EQ(bench.Last<DeviceLink>(), DeviceLink{true});
  EXPECT_EQ(bench.Last<RobotPath>().crc32, 0x1234ABCDU);
}

}  // namespace
}  // namespace forgescan
