// Two stations at once on one host, as two users start them. There is no cell: cameras and devices are
// absent.
#pragma once

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <fstream>
#include <set>

#include "services/common/bus/channels.h"
#include "services/common/bus/lcm_bus.h"
#include "services/common/bus/stream_hub.h"
#include "services/common/service/station.h"
#include "tests/line/prepared_station.h"
#include "tools/forgescan/station/station_services.h"

namespace forgescan::testing {

class TwoStations : public ::testing::Test {
 protected:
  static constexpr std::int64_t kPatienceUs = 90'000'000;
  static constexpr const char* kName[2] = {"north", "south"};
  static constexpr const char* kBusPort[2] = {"7667", "7668"};
  static constexpr const char* kCanPort[2] = {"43113", "43114"};

  static void SetUpTestSuite() {
    base_ = std::filesystem::path(::testing::TempDir()) / ("forgescan_two_" + std::to_string(getpid()));
    WriteSmallStation(base_, {{"silence_s = 30.0", "silence_s = 8.0\nstage_patience_s = 3.0"},
                              {"folder = \"../recordings\"", "folder = \"recordings\""}});
    const std::string tool = std::string(FORGESCAN_BIN_DIR) + "/forgescan";
    const auto prepared = RunCommand(tool + "-virtual-station prepare --scale-divisor 4 --station " +
                                     (base_ / "station").string() + " --run " + (base_ / "run").string());
    ASSERT_EQ(prepared.exit_code, 0) << prepared.text;
    const std::filesystem::path model = base_ / "run/station/model";
    const auto imported = RunCommand(tool + " model import " + (model / "axle.step").string() + " --out " +
                                     (model / "axle.bundle").string());
    ASSERT_EQ(imported.exit_code, 0) << imported.text;
    for (const int i : {0, 1}) {
      std::filesystem::copy(base_ / "run/station", Folder(i), std::filesystem::copy_options::recursive);
      const std::string text = ReadAll(Folder(i) / "station.toml");
      std::ofstream(Folder(i) / "station.toml")
          << Replaced(Replaced(Replaced(text, "virtual-small\"", std::string(kName[i]) + "\""), ":7667?",
                               ":" + std::string(kBusPort[i]) + "?"),
                      ":43113", ":" + std::string(kCanPort[i]));
    }
  }
  static void TearDownTestSuite() {
    if (!::testing::UnitTest::GetInstance()->Failed()) {
      std::filesystem::remove_all(base_);
    }
  }
  static std::filesystem::path Folder(int i) { return base_ / kName[i]; }
  static std::string Replaced(std::string text, const std::string& from, const std::string& to) {
    const std::size_t at = text.find(from);
    EXPECT_NE(at, std::string::npos) << from;
    return text.replace(at, from.size(), to);
  }
  static std::string LogOf(int i) { return ReadAll(Folder(i) / "log/supervisor.log"); }

  // Listens to one station's bus.
  struct Ear {
    explicit Ear(int i) {
      auto station = Station::Load(Folder(i).string());
      EXPECT_TRUE(station.ok());
      hash = station->file.hash();
      bus = std::move(*LcmBus::Open(station->bus_url));
      SubscribeState<fsmsg::service_state_t>(*bus, kServiceState,
                                             [this](const fsmsg::service_state_t& state) {
                                               sessions[state.name].insert(state.session);
                                               hashes.insert(state.config_hash);
                                             });
    }
    std::string hash;
    std::unique_ptr<LcmBus> bus;
    std::map<std::string, std::set<std::int64_t>> sessions;
    std::set<std::string> hashes;
  };
  template <typename Condition>
  bool RunUntil(const Condition& condition) {
    const std::int64_t until_us = ears_[0]->bus->NowUs() + kPatienceUs;
    while (!condition() && ears_[0]->bus->NowUs() < until_us) {
      for (const auto& ear : ears_) {
        EXPECT_TRUE(ear->bus->RunOnce(10'000).ok());
      }
    }
    return condition();
  }
  void Up() {
    for (const int i : {0, 1}) {
      ears_[static_cast<std::size_t>(i)] = std::make_unique<Ear>(i);
      up_[static_cast<std::size_t>(i)] = std::make_unique<Background>(
          std::vector<std::string>{"forgescan", "station", "up", Folder(i).string()},
          base_ / (std::string(kName[i]) + ".txt"));
    }
    ASSERT_TRUE(RunUntil([&] {
      return ears_[0]->sessions.size() == StationServices({}).size() &&
             ears_[1]->sessions.size() == StationServices({}).size();
    })) << LogOf(0)
        << LogOf(1);
  }
  void Down() {
    for (const int i : {0, 1}) {
      const auto down =
          RunCommand(std::string(FORGESCAN_BIN_DIR) + "/forgescan station down " + Folder(i).string());
      EXPECT_EQ(down.exit_code, 0) << down.text;
      EXPECT_EQ(up_[static_cast<std::size_t>(i)]->Wait(30), 0) << up_[static_cast<std::size_t>(i)]->Text();
      EXPECT_EQ(LogOf(i).find("KILLED"), std::string::npos) << LogOf(i);
    }
  }

  inline static std::filesystem::path base_;
  std::array<std::unique_ptr<Ear>, 2> ears_;
  std::array<std::unique_ptr<Background>, 2> up_;
};

}  // namespace forgescan::testing
