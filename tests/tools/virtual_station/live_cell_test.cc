// The live cell as the drivers of the services see it: over the CAN bus, in real time.
#include "tools/virtual_station/station/live_cell.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <chrono>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>

#include "drivers/can/open_can_bus.h"

namespace forgescan {
namespace {

namespace fs = std::filesystem;

const std::string kCell = std::string(FORGESCAN_SOURCE_DIR) + "/stations/virtual/cell.toml";
constexpr const char* kCan = "udp:239.74.163.2:43119";
constexpr int kDivisor = 4;  // 612 x 512 px: rendered in time
constexpr std::int64_t kPatience_us = 60'000'000;

std::int64_t NowUs() {
  return std::chrono::duration_cast<std::chrono::microseconds>(
             std::chrono::steady_clock::now().time_since_epoch())
      .count();
}

// The cell, and the host's end of its devices.
class LiveCellTest : public ::testing::Test {
 protected:
  void SetUp() override {
    truth_ = fs::path(::testing::TempDir()) / ("forgescan_live_cell_" + std::to_string(getpid()));
    fs::create_directories(truth_);
    auto config = LoadCellConfig(kCell, kDivisor);
    ASSERT_TRUE(config.ok()) << config.error().message;
    first_view_s_ = config->heat.first_view_s;
    auto cell = LiveCell::Create(
        std::move(*config),
        {.can_url = kCan, .camera_address = {"127.0.0.1", "127.0.0.2"}, .truth_folder = truth_.string()});
    ASSERT_TRUE(cell.ok()) << cell.error().message;
    cell_ = std::move(*cell);
    auto bus = OpenCanBus(kCan, NowUs);
    ASSERT_TRUE(bus.ok()) << bus.error().message;
    bus_ = std::move(*bus);
    robot_ = MakeCanRobot(*bus_);
    trigger_ = MakeCanTrigger(*bus_);
    line_ = MakeCanLine(*bus_);
    robot_->SetHandler([this](const RobotEvent& event) { Keep(event, robot_status_); });
    trigger_->SetHandler([this](const TriggerEvent& event) { Keep(event, trigger_status_); });
    line_->SetHandler([this](const LineEvent& event) { Keep(event, part_); });
  }
  void TearDown() override { fs::remove_all(truth_); }

  template <typename Event, typename Kept>
  static void Keep(const Event& event, Kept& kept) {
    if (const auto* news = std::get_if<Kept>(&event)) {
      kept = *news;
    }
  }

  template <typename Done>
  bool RunUntil(const Done& done) {
    const std::int64_t until_us = NowUs() + kPatience_us;
    while (!done() && NowUs() < until_us) {
      const Status stepped = cell_->Step();
      EXPECT_TRUE(stepped.ok()) << stepped.error().message;
      EXPECT_TRUE(bus_->Drain().ok());
      robot_->Step(NowUs());
      trigger_->Step(NowUs());
      line_->Step(NowUs());
    }
    return done();
  }

  bool Order(RobotOrder order, std::uint16_t view) {
    const auto seq = static_cast<std::uint16_t>(robot_status_.seq_echo + 1);
    EXPECT_TRUE(robot_->Send({.seq = seq, .order = order, .path = 1, .view = view}).ok());
    return RunUntil([&] {
      const bool done = order == RobotOrder::kGoView ? robot_status_.in_position : robot_status_.path_valid;
      return robot_status_.seq_echo == seq && done;
    });
  }

  bool Expose(std::uint16_t view) {
    const auto seq = static_cast<std::uint16_t>(trigger_status_.seq_echo + 1);
    EXPECT_TRUE(trigger_
                    ->Send({.seq = seq,
                            .mode = TriggerMode::kFire,
                            .view = view,
                            .pulses = 2,
                            .period_us = 50'000,
                            .exposure_us = 12'000})
                    .ok());
    return RunUntil(
        [&] { return trigger_status_.seq_echo == seq && trigger_status_.state == TriggerState::kDone; });
  }

  // The truth of part 1, once the line has sorted it.
  nlohmann::json SortAndReadTruth() {
    EXPECT_TRUE(line_->Send({.part = 1, .verdict = LineVerdict::kOk, .seq = 1}).ok());
    const fs::path file = truth_ / "part_000001.json";
    EXPECT_TRUE(RunUntil([&] { return fs::exists(file); }));
    std::ifstream stream(file);
    return nlohmann::json::parse(stream, nullptr, false);
  }

  fs::path truth_;
  double first_view_s_ = 0;
  std::unique_ptr<LiveCell> cell_;
  std::unique_ptr<CanBus> bus_;
  std::unique_ptr<Robot> robot_;
  std::unique_ptr<Trigger> trigger_;
  std::unique_ptr<LineSignals> line_;
  RobotStatus robot_status_;
  TriggerStatus trigger_status_;
  LinePart part_;
};

TEST_F(LiveCellTest, AViewTakenAgainIsSeenAnew) {
  ASSERT_TRUE(RunUntil([&] {
    return robot_status_.state == RobotState::kHome && trigger_status_.state != TriggerState::kBoot;
  }));
  cell_->StartLine();
  ASSERT_TRUE(RunUntil([&] { return part_.in_place; }));
  ASSERT_TRUE(Order(RobotOrder::kSelectPath, 0));
  ASSERT_TRUE(Order(RobotOrder::kGoView, 0));
  ASSERT_TRUE(Expose(0));
  ASSERT_TRUE(Order(RobotOrder::kGoView, 0));
  ASSERT_TRUE(Expose(0));
  const auto truth = SortAndReadTruth();
  ASSERT_EQ(truth["views"].size(), 1u) << truth.dump(1);
  const auto& view = truth["views"][0];
  EXPECT_EQ(view["visit"], 1);
  // One move lies between the two orders, and another behind the second. The cell's thermal clock waits for
  // pictures, but not during moves.
  const double move_s = 1e-6 * static_cast<double>(RobotSimConfig().move_us);
  EXPECT_GT(view["time_s"].get<double>(), first_view_s_ + 2 * move_s);
}

TEST_F(LiveCellTest, APartThatIsSortedBeforeItIsPreparedHasItsTruth) {
  cell_->StartLine();
  ASSERT_TRUE(RunUntil([&] { return part_.in_place; }));
  EXPECT_EQ(SortAndReadTruth()["part"], 1);
}

}  // namespace
}  // namespace forgescan
