// A recorder on a simulated bus, with a world that talks to it.
#pragma once

#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "services/common/bus/channels.h"
#include "services/common/bus/sim_bus.h"
#include "services/recorder/recorder_service.h"
#include "tests/services/recorder/line_script.h"
#include "tests/services/recorder/recordings.h"

namespace forgescan::testing {

class RecorderRig : public ::testing::Test {
 protected:
  static constexpr std::int64_t kSecondUs = 1'000'000;

  void SetUp() override {
    base_ = std::filesystem::path(::testing::TempDir()) / ("forgescan_recorder_" + std::to_string(getpid()));
    std::filesystem::remove_all(base_);
    std::filesystem::create_directories(base_);
    config_.folder = (base_ / "recordings").string();
    config_.min_free_mb = 1;
    std::ofstream(base_ / "station.toml") << "# a station\n";
    station_ = {"test", "1.2.3", "compiler", "abcd", {{"station.toml", (base_ / "station.toml").string()}}};
    SubscribeState<fsmsg::recorder_state_t>(
        world_.bus(), kRecorderState, [this](const fsmsg::recorder_state_t& m) { states_.push_back(m); });
  }
  void TearDown() override {
    service_.reset();
    std::filesystem::remove_all(base_);
  }
  void Start() {
    auto service = RecorderService::Create(hub_, monitor_, config_, station_);
    ASSERT_TRUE(service.ok()) << service.error().message;
    service_ = *std::move(service);
    Settle();
  }
  // Until the writer has done what it was told, and the service knows.
  void Settle() {
    service_->Drain();
    network_.RunFor(kSecondUs);
  }
  void Run(double seconds) { network_.RunFor(static_cast<std::int64_t>(seconds * 1e6)); }
  std::vector<Recording> Stop() {
    service_.reset();
    return ReadRecordings(config_.folder);
  }
  std::function<void()> Pause() {
    return [this] { network_.RunFor(2'000); };
  }

  std::filesystem::path base_;
  SimNetwork network_{3};
  RecorderConfig config_;
  RecordedStation station_;
  StreamHub hub_{network_.AddNode(), "recorder"};
  ServiceMonitor monitor_{hub_, "recorder", "abcd"};
  StreamHub world_{network_.AddNode(), "world"};
  std::vector<fsmsg::recorder_state_t> states_;
  std::unique_ptr<RecorderService> service_;
};

}  // namespace forgescan::testing
