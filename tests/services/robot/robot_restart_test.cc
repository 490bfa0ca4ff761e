// A robot service that is killed and started again: the scan is ended by name, the part is not scanned twice,
// no verdict is sorted twice. On the real drivers, over a simulated CAN bus.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>

#include "drivers/can/can_inprocess.h"
#include "drivers/line/line_canopen.h"
#include "drivers/line/line_sim.h"
#include "drivers/robot/robot_canopen.h"
#include "drivers/robot/robot_sim.h"
#include "services/common/bus/sim_bus.h"
#include "services/robot/robot_service.h"
#include "tools/virtual_station/nodes/device_node.h"

namespace forgescan {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;

constexpr std::int64_t kSecondUs = 1'000'000;
constexpr int kViews = 4;

// What dies with the process.
class Process {
 public:
  Process(SimNetwork& network, InProcessCan& wire, const std::string& memory)
      : network_(network),
        can_(wire.Attach()),
        robot_(MakeCanRobot(*can_)),
        line_(MakeCanLine(*can_)),
        service_(std::make_unique<RobotService>(*hub_, *monitor_, RobotService::Devices{*robot_, *line_},
                                                RobotConfig{}, memory)) {}
  ~Process() {
    service_.reset();
    monitor_.reset();
    hub_.reset();
    network_.RemoveNode(bus_);
  }
  Process(const Process&) = delete;
  Process& operator=(const Process&) = delete;
  CanBus& can() { return *can_; }
  const ServiceMonitor& monitor() const { return *monitor_; }

 private:
  SimNetwork& network_;
  SimBus& bus_ = network_.AddNode();
  std::unique_ptr<StreamHub> hub_ = std::make_unique<StreamHub>(bus_, "robot");
  std::unique_ptr<ServiceMonitor> monitor_ = std::make_unique<ServiceMonitor>(*hub_, "robot", "");
  std::unique_ptr<CanBus> can_;
  std::unique_ptr<Robot> robot_;
  std::unique_ptr<LineSignals> line_;
  std::unique_ptr<RobotService> service_;
};

class RobotRestartTest : public ::testing::Test {
 protected:
  RobotRestartTest() {
    fs::remove_all(folder_);
    world_.Subscribe<fsmsg::part_arrived_t>(kPartArrived, [this](const auto& m) { arrived_.push_back(m); });
    world_.Subscribe<fsmsg::scan_complete_t>(kScanComplete, [this](const auto& m) { scans_.push_back(m); });
    world_.Subscribe<fsmsg::part_sorted_t>(kPartSorted, [this](const auto& m) { sorted_.push_back(m); });
    world_.Subscribe<fsmsg::view_ready_t>(kViewReady, [this](const auto& m) { Capture(m); });
    world_.bus().Every(1000, [this] { StepWorld(); });
    world_.bus().Every(kSecondUs / 2, [this] {
      fsmsg::cooling_state_t state{};
      state.interlock = fsmsg::cooling_state_t::INTERLOCK_CLEAR;
      EXPECT_TRUE(PublishState(world_.bus(), kCoolingState, state).ok());
    });
    Start();
  }
  ~RobotRestartTest() override {
    process_.reset();
    fs::remove_all(folder_);
  }
  static RobotSimConfig Path() {
    RobotSimConfig path;
    path.view_count = kViews;
    return path;
  }
  void StepWorld() {
    wire_.StepTo(network_.NowUs());
    EXPECT_TRUE(node_can_->Drain().ok());
    robot_node_.Step(network_.NowUs());
    line_node_.Step(network_.NowUs());
    if (process_ != nullptr) {
      EXPECT_TRUE(process_->can().Drain().ok());
    }
  }
  void Capture(const fsmsg::view_ready_t& ready) {
    ++views_;
    fsmsg::view_captured_t captured{};
    captured.utime = ready.utime;
    captured.part = ready.part;
    captured.view = ready.view;
    captured.attempt = ready.attempt;
    captured.status = fsmsg::view_captured_t::STATUS_CAPTURED;
    EXPECT_TRUE(world_.Publish(kViewCaptured, captured).ok());
  }
  void Start() { process_ = std::make_unique<Process>(network_, wire_, memory_.string()); }
  // As SIGKILL does: nothing of what the service does when it ends is heard or written.
  void Kill() {
    fs::copy_file(memory_, folder_ / "kept", fs::copy_options::overwrite_existing);
    network_.SetFaults({.loss = 1.0, .large_loss = 1.0});
    process_.reset();
    network_.SetFaults({});
    fs::copy_file(folder_ / "kept", memory_, fs::copy_options::overwrite_existing);
    network_.RunFor(kSecondUs);
  }
  void Verdict(int part, std::int64_t utime) {
    fsmsg::verdict_t verdict{};
    verdict.utime = utime;
    verdict.part = part;
    verdict.verdict = fsmsg::verdict_t::VERDICT_OK;
    EXPECT_TRUE(world_.Publish(kVerdict, verdict).ok());
    network_.RunFor(2 * kSecondUs);
  }
  bool RunUntilViews(int views) {
    return network_.RunUntilTrue([&] { return views_ >= views; }, 60 * kSecondUs);
  }
  bool RunUntilScans(std::size_t scans) {
    return network_.RunUntilTrue([&] { return scans_.size() >= scans; }, 90 * kSecondUs);
  }

  fs::path folder_ = fs::temp_directory_path() / fmt::format("forgescan-robot-{}", getpid());
  fs::path memory_ = folder_ / "robot_parts.txt";
  SimNetwork network_;
  InProcessCan wire_{{}, network_.NowUs()};
  std::unique_ptr<CanBus> node_can_ = wire_.Attach();
  RobotSim robot_sim_{Path()};
  LineSim line_sim_;
  RobotNode robot_node_{*node_can_, robot_sim_};
  LineNode line_node_{*node_can_, line_sim_};
  StreamHub world_{network_.AddNode(), "world"};
  std::unique_ptr<Process> process_;
  std::vector<fsmsg::part_arrived_t> arrived_;
  std::vector<fsmsg::scan_complete_t> scans_;
  std::vector<fsmsg::part_sorted_t> sorted_;
  int views_ = 0;
};

TEST_F(RobotRestartTest, EndsTheScanByNameAndDoesNotScanThePartAgain) {
  ASSERT_TRUE(RunUntilViews(3));
  Kill();
  Start();
  ASSERT_TRUE(RunUntilScans(1));
  EXPECT_EQ(scans_[0].part, 1);
  EXPECT_EQ(scans_[0].status, fsmsg::scan_complete_t::STATUS_ABORTED);
  EXPECT_EQ(scans_[0].scan_start_utime, arrived_.at(0).utime);
  EXPECT_EQ(scans_[0].views_expected, kViews);
  EXPECT_GE(scans_[0].views_captured, 2);
  EXPECT_THAT(scans_[0].reason, HasSubstr("started again during the scan"));
  network_.RunFor(20 * kSecondUs);  // the part is still in place
  EXPECT_EQ(arrived_.size(), 1u);
  ASSERT_TRUE(RunUntilScans(2)) << "the next part";
  EXPECT_EQ(scans_[1].part, 2);
  EXPECT_EQ(scans_[1].reason, "");
  EXPECT_EQ(scans_[1].views_captured, kViews);
}

TEST_F(RobotRestartTest, AScannedPartIsLeftAlone) {
  ASSERT_TRUE(RunUntilScans(1));
  Kill();
  Start();
  network_.RunFor(10 * kSecondUs);  // homed, and the part is still in place
  EXPECT_EQ(scans_.size(), 1u);
  EXPECT_EQ(arrived_.size(), 1u);
  EXPECT_EQ(process_->monitor().state(), ServiceState::kReady);
}

TEST_F(RobotRestartTest, SortsWhatItHadNoTimeToSortAndNothingTwice) {
  ASSERT_TRUE(RunUntilScans(1));
  Kill();
  Start();
  network_.RunFor(3 * kSecondUs);
  Verdict(1, scans_[0].utime);  // said again by the report
  ASSERT_EQ(sorted_.size(), 1u);
  EXPECT_EQ(sorted_[0].acknowledged, 1);
  Verdict(1, scans_[0].utime);
  Kill();
  Start();
  network_.RunFor(3 * kSecondUs);
  Verdict(1, scans_[0].utime);
  EXPECT_EQ(sorted_.size(), 1u);
  EXPECT_EQ(line_sim_.sorted().size(), 1u);
}

TEST_F(RobotRestartTest, AStoppedServiceEndsItsScanItself) {
  ASSERT_TRUE(RunUntilViews(2));
  process_.reset();
  network_.RunFor(kSecondUs);
  ASSERT_EQ(scans_.size(), 1u);
  EXPECT_THAT(scans_[0].reason, HasSubstr("the robot service was stopped"));
  Start();
  network_.RunFor(10 * kSecondUs);
  EXPECT_EQ(scans_.size(), 1u) << "told once";
}

TEST_F(RobotRestartTest, APartOfLongAgoIsNotTheOneInPlace) {
  ASSERT_TRUE(RunUntilViews(2));
  Kill();
  std::ofstream(memory_) << "1 " << network_.NowUs() - 700 * kSecondUs << " 4 1 0 0\n";
  Start();
  ASSERT_TRUE(RunUntilScans(1));
  EXPECT_EQ(scans_[0].reason, "") << "the part in place has that number by chance";
  EXPECT_EQ(arrived_.size(), 2u);
}

TEST_F(RobotRestartTest, ADamagedMemoryIsNamedAndTheNextPartIsScanned) {
  ASSERT_TRUE(RunUntilScans(1));
  Kill();
  std::ofstream(memory_) << "1 17 four\n";
  Start();
  EXPECT_THAT(process_->monitor().last_error(), HasSubstr("robot_parts.txt: \"1 17 four\" is no part"));
  ASSERT_TRUE(RunUntilScans(2));
}

}  // namespace
}  // namespace forgescan
