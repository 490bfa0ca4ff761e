// The robot, trigger and cooling services on their real drivers, over a simulated CAN bus, with the simulated
// devices behind it and a simulated network between them: everything of the cell but cameras and computing.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "drivers/can/can_inprocess.h"
#include "services/common/bus/sim_bus.h"
#include "services/cooling/cooling_service.h"
#include "services/robot/robot_service.h"
#include "services/trigger/trigger_service.h"
#include "tools/virtual_station/nodes/device_node.h"

namespace forgescan {
namespace {

using testing::HasSubstr;

constexpr std::int64_t kSecond_us = 1'000'000;

struct Host {
  explicit Host(SimNetwork& network, const std::string& name)
      : bus(network.AddNode()), hub(bus, name), monitor(hub, name, "0") {}
  SimBus& bus;
  StreamHub hub;
  ServiceMonitor monitor;
};

class Cell : public testing::Test {
 protected:
  Cell() {
    RobotSimConfig path;
    path.view_count = 3;
    robot_sim_ = std::make_unique<RobotSim>(path);
    line_sim_.SetTemperature([](std::uint32_t, std::int64_t in_place_us) {
      return 900 - 1e-6 * static_cast<double>(in_place_us);
    });
    robot_node_.emplace(*node_can_, *robot_sim_);
    SubscribeAll();
    world_.bus.Every(1000, [this] { StepWorld(); });
  }

  void StepWorld() {
    const std::int64_t now_us = network_.NowUs();
    wire_.StepTo(now_us);
    EXPECT_TRUE(node_can_->Drain().ok());
    robot_node_->Step(now_us);
    trigger_node_.Step(now_us);
    cooling_node_.Step(now_us);
    line_node_.Step(now_us);
    for (CanBus* bus : {robot_can_.get(), trigger_can_.get(), cooling_can_.get()}) {
      EXPECT_TRUE(bus->Drain().ok());
    }
  }

  void SubscribeAll() {
    world_.hub.Subscribe<fsmsg::part_arrived_t>(kPartArrived,
                                                [this](const auto& m) { arrived_.push_back(m); });
    world_.hub.Subscribe<fsmsg::exposure_t>(kExposure, [this](const auto& m) { exposures_.push_back(m); });
    world_.hub.Subscribe<fsmsg::view_captured_t>(kViewCaptured,
                                                 [this](const auto& m) { views_.push_back(m); });
    world_.hub.Subscribe<fsmsg::part_temperature_t>(kPartTemperature,
                                                    [this](const auto& m) { temperatures_.push_back(m); });
    world_.hub.Subscribe<fsmsg::scan_complete_t>(kScanComplete,
                                                 [this](const auto& m) { scans_.push_back(m); });
    world_.hub.Subscribe<fsmsg::part_sorted_t>(kPartSorted, [this](const auto& m) { sorted_.push_back(m); });
  }

  bool RunUntilScans(std::size_t count, std::int64_t seconds = 60) {
    return network_.RunUntilTrue([&] { return scans_.size() >= count; }, seconds * kSecond_us);
  }
  void Verdict(int part, int verdict) { Verdict(part, verdict, network_.NowUs()); }
  void Verdict(int part, int verdict, std::int64_t utime) {
    fsmsg::verdict_t message{};
    message.utime = utime;
    message.part = part;
    message.verdict = static_cast<std::int8_t>(verdict);
    EXPECT_TRUE(world_.hub.Publish(kVerdict, message).ok());
  }

  SimNetwork network_;
  InProcessCan wire_{{}, network_.NowUs()};
  std::unique_ptr<CanBus> node_can_ = wire_.Attach();
  std::unique_ptr<CanBus> robot_can_ = wire_.Attach();
  std::unique_ptr<CanBus> trigger_can_ = wire_.Attach();
  std::unique_ptr<CanBus> cooling_can_ = wire_.Attach();
  std::unique_ptr<RobotSim> robot_sim_;
  TriggerSim trigger_sim_;
  CoolingSim cooling_sim_;
  LineSim line_sim_;
  std::optional<RobotNode> robot_node_;
  TriggerNode trigger_node_{*node_can_, trigger_sim_};
  CoolingNode cooling_node_{*node_can_, cooling_sim_};
  LineNode line_node_{*node_can_, line_sim_};

  Host world_{network_, "world"};
  Host robot_host_{network_, "robot"};
  Host trigger_host_{network_, "trigger"};
  Host cooling_host_{network_, "cooling"};
  std::unique_ptr<Robot> robot_ = MakeCanRobot(*robot_can_);
  std::unique_ptr<LineSignals> line_ = MakeCanLine(*robot_can_);
  std::unique_ptr<Trigger> trigger_ = MakeCanTrigger(*trigger_can_);
  std::unique_ptr<CoolingUnit> cooling_ = MakeCanCooling(*cooling_can_);
  RobotService robot_service_{robot_host_.hub, robot_host_.monitor, {*robot_, *line_}, RobotConfig{}};
  TriggerService trigger_service_{trigger_host_.hub, trigger_host_.monitor, *trigger_, TriggerConfig{}};
  CoolingService cooling_service_{cooling_host_.hub, cooling_host_.monitor, *cooling_, CoolingConfig{}};

  std::vector<fsmsg::part_arrived_t> arrived_;
  std::vector<fsmsg::exposure_t> exposures_;
  std::vector<fsmsg::view_captured_t> views_;
  std::vector<fsmsg::part_temperature_t> temperatures_;
  std::vector<fsmsg::scan_complete_t> scans_;
  std::vector<fsmsg::part_sorted_t> sorted_;
};

TEST_F(Cell, Starts) {
  network_.RunFor(kSecond_us);
  EXPECT_EQ(trigger_host_.monitor.state(), ServiceState::kReady);
}

TEST_F(Cell, ScansAPartAndSortsIt) {
  ASSERT_TRUE(RunUntilScans(1));
  network_.RunFor(kSecond_us);
  ASSERT_EQ(arrived_.size(), 1U);
  EXPECT_EQ(arrived_[0].view_count, 3);
  EXPECT_EQ(static_cast<std::uint32_t>(arrived_[0].path_crc32), 0x1234ABCDU);
  EXPECT_EQ(scans_[0].status, fsmsg::scan_complete_t::STATUS_COMPLETE) << scans_[0].reason;
  EXPECT_EQ(scans_[0].views_captured, 3);
  EXPECT_EQ(views_.size(), 3U);
  EXPECT_EQ(exposures_.size(), 48U);  // 3 views x 8 patterns x 2 cameras
  ASSERT_EQ(temperatures_.size(), 3U);
  EXPECT_EQ(temperatures_[0].valid, 1);
  EXPECT_NEAR(temperatures_[0].temperature_degc, 897, 2);  // 1 K/s for some 3 s
  Verdict(1, fsmsg::verdict_t::VERDICT_NOT_OK);
  network_.RunFor(2 * kSecond_us);
  ASSERT_EQ(sorted_.size(), 1U);
  EXPECT_EQ(sorted_[0].acknowledged, 1) << sorted_[0].reason;
  EXPECT_EQ(line_sim_.sorted().at(0).verdict, LineVerdict::kNotOk);
  EXPECT_EQ(robot_sim_->status().state, RobotState::kHome);
}

TEST_F(Cell, ScansPartAfterPart) {
  ASSERT_TRUE(RunUntilScans(3, 150));
  EXPECT_EQ(arrived_.size(), 3U);
  EXPECT_EQ(scans_[2].part, 3);
  EXPECT_EQ(scans_[2].status, fsmsg::scan_complete_t::STATUS_COMPLETE) << scans_[2].reason;
}

TEST_F(Cell, TakesAVoidViewAgain) {
  trigger_sim_.SetFaults({.lose_pulse_of_view = 2});
  ASSERT_TRUE(network_.RunUntilTrue([&] { return !views_.empty(); }, 30 * kSecond_us));
  EXPECT_EQ(views_[0].status, fsmsg::view_captured_t::STATUS_VOID);
  trigger_sim_.SetFaults({});
  ASSERT_TRUE(RunUntilScans(1));
  EXPECT_EQ(scans_[0].status, fsmsg::scan_complete_t::STATUS_COMPLETE) << scans_[0].reason;
  EXPECT_EQ(views_.size(), 4U);
  EXPECT_EQ(views_[1].attempt, 1);
}

TEST_F(Cell, AViewThatStaysVoidIsNamedInTheResult) {
  trigger_sim_.SetFaults({.lose_record = 2});
  ASSERT_TRUE(RunUntilScans(1));
  EXPECT_EQ(scans_[0].status, fsmsg::scan_complete_t::STATUS_ABORTED);
  EXPECT_EQ(scans_[0].views_captured, 0);
  EXPECT_THAT(scans_[0].reason, HasSubstr("view 2 is void"));
}

TEST_F(Cell, OverTemperatureStopsThePartInWorkAndTheNext) {
  ASSERT_TRUE(network_.RunUntilTrue([&] { return views_.size() == 1; }, 30 * kSecond_us));
  cooling_sim_.SetHeatLoad(50'000);  // 25 K/s
  cooling_sim_.SetAmbient(41);
  ASSERT_TRUE(RunUntilScans(1));
  EXPECT_EQ(scans_[0].status, fsmsg::scan_complete_t::STATUS_ABORTED);
  EXPECT_THAT(scans_[0].reason, HasSubstr("cooling interlock"));
  ASSERT_TRUE(RunUntilScans(2));
  EXPECT_EQ(scans_[1].part, 2);
  EXPECT_EQ(scans_[1].views_captured, 0);
  EXPECT_EQ(robot_sim_->status().state, RobotState::kHome);
}

TEST_F(Cell, ALostEchoAbortsThePartAndTheNextOneWorks) {
  ASSERT_TRUE(network_.RunUntilTrue([&] { return views_.size() == 1; }, 30 * kSecond_us));
  robot_sim_->SetFaults({.deaf = true});
  ASSERT_TRUE(RunUntilScans(1));
  EXPECT_THAT(scans_[0].reason, HasSubstr("did not echo"));
  robot_sim_->SetFaults({});
  ASSERT_TRUE(RunUntilScans(2));
  EXPECT_EQ(scans_[1].status, fsmsg::scan_complete_t::STATUS_COMPLETE) << scans_[1].reason;
}

TEST_F(Cell, StuckRobotWrongEchoAndProtectiveStopAbortWithAReason) {
  const std::pair<RobotSimFaults, const char*> cases[] = {{{.stuck = true}, "reached in time"},
                                                          {{.protective_stop = true}, "fault"},
                                                          {{.wrong_view_echo = true}, "did not echo"}};
  std::size_t scans = 0;
  for (const auto& [faults, reason] : cases) {
    const std::size_t views = views_.size();
    ASSERT_TRUE(network_.RunUntilTrue([&] { return views_.size() > views; }, 90 * kSecond_us));
    robot_sim_->SetFaults(faults);
    ASSERT_TRUE(RunUntilScans(++scans));
    EXPECT_THAT(scans_.back().reason, HasSubstr(reason));
    robot_sim_->SetFaults({});
    EXPECT_TRUE(robot_sim_->Send({60'000, RobotOrder::kResetFault, 1, 0}).ok());  // by the operator
  }
}

TEST_F(Cell, BusOffAbortsAndRecovers) {
  ASSERT_TRUE(network_.RunUntilTrue([&] { return views_.size() == 1; }, 30 * kSecond_us));
  wire_.SetBusOff(true);
  ASSERT_TRUE(RunUntilScans(1));
  // The lost echo is noticed before the lost heartbeat when an order is under way.
  EXPECT_THAT(scans_[0].reason, testing::AnyOf(HasSubstr("stopped answering"), HasSubstr("did not echo")));
  network_.RunFor(2 * kSecond_us);
  wire_.SetBusOff(false);
  ASSERT_TRUE(RunUntilScans(2));
  EXPECT_EQ(scans_[1].status, fsmsg::scan_complete_t::STATUS_COMPLETE) << scans_[1].reason;
}

TEST_F(Cell, ALossyCanBusDelaysButDoesNotBreakAScan) {
  network_.RunFor(kSecond_us / 2);
  wire_.SetFaults({.loss = 0.02, .duplicate = 0.05, .seed = 5});
  ASSERT_TRUE(RunUntilScans(1));
  EXPECT_EQ(scans_[0].part, 1);
  EXPECT_FALSE(views_.empty());  // a lost record makes a view void, with a reason; nothing hangs
}

// The controller knows the orders of a service that died; the next service must not repeat their numbers.
TEST_F(Cell, AServiceThatRestartsTakesTheControllersNumbersUp) {
  ASSERT_TRUE(RunUntilScans(1));
  const std::uint16_t seq_before = robot_sim_->status().seq_echo;
  Host host(network_, "robot again");
  auto can = wire_.Attach();
  const auto robot = MakeCanRobot(*can);
  RobotMachine machine{RobotConfig{}};
  std::vector<std::uint16_t> sequence;
  robot->SetHandler([&](const RobotEvent& event) {
    RobotMachine::Actions actions;
    if (const auto* link = std::get_if<DeviceLink>(&event)) {
      actions = machine.OnLink(link->up, network_.NowUs());
    } else if (const auto* status = std::get_if<RobotStatus>(&event)) {
      actions = machine.OnStatus(*status);
    }
    for (const RobotAction& action : actions) {
      if (const auto* order = std::get_if<RobotCommand>(&action)) {
        sequence.push_back(order->seq);
      }
    }
  });
  host.bus.Every(1000, [&] {
    EXPECT_TRUE(can->Drain().ok());
    robot->Step(network_.NowUs());
  });
  network_.RunFor(2 * kSecond_us);
  ASSERT_FALSE(sequence.empty());
  EXPECT_GT(sequence.front(), seq_before);
}

TEST_F(Cell, AVerdictOnAnEarlierPartOfTheSameNumberSortsNothing) {
  ASSERT_TRUE(RunUntilScans(1));
  Verdict(1, fsmsg::verdict_t::VERDICT_OK, arrived_.at(0).utime - 1);
  network_.RunFor(2 * kSecond_us);
  EXPECT_TRUE(sorted_.empty());
  Verdict(1, fsmsg::verdict_t::VERDICT_NOT_OK, arrived_.at(0).utime);
  network_.RunFor(2 * kSecond_us);
  ASSERT_EQ(sorted_.size(), 1U);
  EXPECT_EQ(line_sim_.sorted().at(0).verdict, LineVerdict::kNotOk);
}

TEST_F(Cell, ALostWordThatTheGateIsDoneIsAskedForAgain) {
  ASSERT_TRUE(RunUntilScans(1));
  Verdict(1, fsmsg::verdict_t::VERDICT_OK);
  network_.RunFor(kSecond_us / 10);  // the gate moves for 0.3 s
  line_sim_.SetFaults({.lost_echo = true});
  network_.RunFor(kSecond_us / 2);
  EXPECT_TRUE(sorted_.empty());
  line_sim_.SetFaults({});
  network_.RunFor(kSecond_us);
  ASSERT_EQ(sorted_.size(), 1U);
  EXPECT_EQ(sorted_[0].acknowledged, 1) << sorted_[0].reason;
  EXPECT_EQ(line_sim_.sorted().size(), 1U);
}

TEST_F(Cell, AnUnheardSortCommandIsReported) {
  ASSERT_TRUE(RunUntilScans(1));
  line_sim_.SetFaults({.wrong_echo = true});
  Verdict(1, fsmsg::verdict_t::VERDICT_OK);
  network_.RunFor(2 * kSecond_us);
  ASSERT_EQ(sorted_.size(), 1U);
  EXPECT_EQ(sorted_[0].acknowledged, 0);
  line_sim_.SetFaults({.stuck_valve = true});
  Verdict(2, fsmsg::verdict_t::VERDICT_OK);
  network_.RunFor(2 * kSecond_us);
  ASSERT_EQ(sorted_.size(), 2U);
  EXPECT_THAT(sorted_[1].reason, HasSubstr("stuck"));
}

}  // namespace
}  // namespace forgescan
