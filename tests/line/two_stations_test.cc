// Two stations at once on one host, as two users start them: nothing one says reaches the other, and what is
// killed or hangs in one is started again there alone. There is no cell: cameras and devices are absent.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <csignal>
#include <nlohmann/json.hpp>
#include <set>

#include "drivers/can/open_can_bus.h"
#include "services/common/bus/channels.h"
#include "services/common/bus/lcm_bus.h"
#include "services/common/bus/stream_hub.h"
#include "services/common/service/station.h"
#include "tests/line/prepared_station.h"
#include "tools/forgescan/station/station_services.h"

namespace forgescan::testing {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;
using State = fsmsg::service_state_t;

constexpr std::int64_t kPatienceUs = 90'000'000;
constexpr const char* kName[2] = {"north", "south"};
constexpr const char* kBusPort[2] = {"7667", "7668"};
constexpr const char* kCanPort[2] = {"43113", "43114"};

class TwoStations : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    base_ = fs::path(::testing::TempDir()) / ("forgescan_two_" + std::to_string(getpid()));
    WriteSmallStation(base_, {{"silence_s = 30.0", "silence_s = 8.0\nstage_patience_s = 3.0"}});
    const std::string tool = std::string(FORGESCAN_BIN_DIR) + "/forgescan";
    const auto prepared = Call(tool + "-virtual-station prepare --scale-divisor 4 --station " +
                               (base_ / "station").string() + " --run " + (base_ / "run").string());
    ASSERT_EQ(prepared.exit_code, 0) << prepared.text;
    const fs::path model = base_ / "run/station/model";
    const auto imported = Call(tool + " model import " + (model / "axle.step").string() + " --out " +
                               (model / "axle.bundle").string());
    ASSERT_EQ(imported.exit_code, 0) << imported.text;
    for (const int i : {0, 1}) {
      fs::copy(base_ / "run/station", Folder(i), fs::copy_options::recursive);
      const std::string text = ReadAll(Folder(i) / "station.toml");
      std::ofstream(Folder(i) / "station.toml")
          << Replaced(Replaced(Replaced(text, "virtual-small\"", std::string(kName[i]) + "\""), ":7667?",
                               ":" + std::string(kBusPort[i]) + "?"),
                      ":43113", ":" + std::string(kCanPort[i]));
    }
  }
  static void TearDownTestSuite() {
    if (!::testing::UnitTest::GetInstance()->Failed()) {
      fs::remove_all(base_);
    }
  }
  static fs::path Folder(int i) { return base_ / kName[i]; }
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
      SubscribeState<State>(*bus, kServiceState, [this](const State& state) {
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
          Call(std::string(FORGESCAN_BIN_DIR) + "/forgescan station down " + Folder(i).string());
      EXPECT_EQ(down.exit_code, 0) << down.text;
      EXPECT_EQ(up_[static_cast<std::size_t>(i)]->Wait(30), 0) << up_[static_cast<std::size_t>(i)]->Text();
      EXPECT_EQ(LogOf(i).find("KILLED"), std::string::npos) << LogOf(i);
    }
  }

  inline static fs::path base_;
  std::array<std::unique_ptr<Ear>, 2> ears_;
  std::array<std::unique_ptr<Background>, 2> up_;
};

TEST_F(TwoStations, HearNothingOfEachOther) {
  Up();
  for (const auto& ear : ears_) {
    EXPECT_THAT(ear->hashes, ::testing::ElementsAre(ear->hash)) << "a service of the other station was heard";
  }
  const auto status =
      Call(std::string(FORGESCAN_BIN_DIR) + "/forgescan station status --json " + Folder(0).string());
  EXPECT_NE(status.exit_code, 0) << "there are no devices";
  const std::size_t begin = status.text.find("{\n"),
                    end = status.text.rfind("}\n");  // then the error's sentence
  ASSERT_LT(begin, end) << status.text;
  const auto json = nlohmann::json::parse(status.text.substr(begin, end + 1 - begin), nullptr, false);
  ASSERT_FALSE(json.is_discarded()) << status.text;
  EXPECT_EQ(json["report"]["state"], "READY");
  EXPECT_EQ(json["robot"]["state"], "ERROR");
  EXPECT_EQ(json["report"]["restarts"], 0);
  EXPECT_GT(json["report"]["memory_mb"].get<double>(), 1.0);
  Down();
}

TEST_F(TwoStations, TheirCanBusesAreApartToo) {
  const auto now_us = [] { return std::int64_t{0}; };
  auto north = OpenCanBus("udp:239.74.163.2:43113", now_us);
  auto near = OpenCanBus("udp:239.74.163.2:43113", now_us),
       far = OpenCanBus("udp:239.74.163.2:43114", now_us);
  ASSERT_TRUE(north.ok() && near.ok() && far.ok());
  int heard_near = 0, heard_far = 0;
  (*near)->AddHandler([&](const CanFrame&) { ++heard_near; });
  (*far)->AddHandler([&](const CanFrame&) { ++heard_far; });
  CanFrame frame;
  frame.id = 0x123;
  ASSERT_TRUE((*north)->Send(frame).ok());
  ASSERT_TRUE((*near)->Drain().ok());
  ASSERT_TRUE((*far)->Drain().ok());
  EXPECT_EQ(heard_near, 1);
  EXPECT_EQ(heard_far, 0);
}

TEST_F(TwoStations, WhatIsKilledOrHangsInOneIsStartedAgainThere) {
  Up();
  const pid_t dead = PidOfService(Folder(0), "fusion"), hung = PidOfService(Folder(0), "report");
  ASSERT_GT(dead, 0);
  ASSERT_GT(hung, 0);
  kill(dead, SIGKILL);
  kill(hung, SIGSTOP);
  EXPECT_TRUE(RunUntil([&] {
    return ears_[0]->sessions["fusion"].size() == 2 && ears_[0]->sessions["report"].size() == 2;
  })) << LogOf(0);
  EXPECT_THAT(LogOf(0), HasSubstr("fusion: was killed by signal 9"));
  EXPECT_THAT(LogOf(0), HasSubstr("report: has been silent for"));
  EXPECT_TRUE(RunUntil([&] { return LogOf(0).find("report: is ready, ") != std::string::npos; })) << LogOf(0);
  for (const auto& [service, sessions] : ears_[1]->sessions) {
    EXPECT_EQ(sessions.size(), 1u) << service;
  }
  Down();
}

TEST_F(TwoStations, AStationThatIsUpIsNotStartedTwice) {
  const auto status =
      Call(std::string(FORGESCAN_BIN_DIR) + "/forgescan station status " + Folder(0).string());
  EXPECT_THAT(status.text, HasSubstr("is not up"));
  Up();
  const auto again = Call(std::string(FORGESCAN_BIN_DIR) + "/forgescan station up " + Folder(0).string());
  EXPECT_NE(again.exit_code, 0);
  EXPECT_THAT(again.text, HasSubstr("is up already"));
  Down();
}

TEST_F(TwoStations, AServiceThatCannotWorkEndsTheStartByName) {
  const fs::path broken = base_ / "broken";
  fs::copy(Folder(1), broken, fs::copy_options::recursive);
  std::ofstream(broken / "pattern.toml") << "patterns = none\n";
  Background up({"forgescan", "station", "up", broken.string()}, base_ / "broken.txt");
  EXPECT_EQ(up.Wait(60), 1);
  EXPECT_THAT(up.Text(), HasSubstr("reconstruction ended with exit code 1"));
  EXPECT_THAT(up.Text(), HasSubstr("pattern.toml"));
}

}  // namespace
}  // namespace forgescan::testing
