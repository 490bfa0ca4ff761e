// Two stations at once on one host, as two users start them: nothing one says reaches the other, and what is
// killed or hangs in one is started again there alone. There is no cell: cameras and devices are absent.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <poll.h>
#include <unistd.h>

#include <algorithm>
#include <csignal>
#include <fstream>
#include <nlohmann/json.hpp>
#include <set>

#include "drivers/can/open_can_bus.h"
#include "services/common/bus/channels.h"
#include "services/common/bus/lcm_bus.h"
#include "services/common/bus/stream_hub.h"
#include "services/common/service/station.h"
#include "tests/line/prepared_station.h"
#include "tools/forgescan/station/process_id.h"
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
    WriteSmallStation(base_, {{"silence_s = 30.0", "silence_s = 8.0\nstage_patience_s = 3.0"},
                              {"folder = \"../recordings\"", "folder = \"recordings\""}});
    const std::string tool = std::string(FORGESCAN_BIN_DIR) + "/forgescan";
    const auto prepared = RunCommand(tool + "-virtual-station prepare --scale-divisor 4 --station " +
                                     (base_ / "station").string() + " --run " + (base_ / "run").string());
    ASSERT_EQ(prepared.exit_code, 0) << prepared.text;
    const fs::path model = base_ / "run/station/model";
    const auto imported = RunCommand(tool + " model import " + (model / "axle.step").string() + " --out " +
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
          RunCommand(std::string(FORGESCAN_BIN_DIR) + "/forgescan station down " + Folder(i).string());
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
      RunCommand(std::string(FORGESCAN_BIN_DIR) + "/forgescan station status --json " + Folder(0).string());
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
  EXPECT_GE(json["report"]["peak_memory_mb"].get<double>(), json["report"]["memory_mb"].get<double>());
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
      RunCommand(std::string(FORGESCAN_BIN_DIR) + "/forgescan station status " + Folder(0).string());
  EXPECT_THAT(status.text, HasSubstr("is not up"));
  Up();
  const auto again =
      RunCommand(std::string(FORGESCAN_BIN_DIR) + "/forgescan station up " + Folder(0).string());
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

// One more station, with a short patience and its own [supervision], and what is done to its processes.
class OneStation {
 public:
  OneStation(const fs::path& like, const std::string& name, const std::string& supervision)
      : folder_(like.parent_path() / name) {
    fs::copy(like, folder_, fs::copy_options::recursive);
    fs::remove_all(folder_ / "log");
    std::string text = ReadAll(folder_ / "station.toml");
    const std::string key = "silence_s = 8.0\n";
    text.insert(text.find(key) + key.size(), "stop_patience_s = 3.0\n" + supervision);
    std::ofstream(folder_ / "station.toml") << text;
  }
  std::vector<std::string> Command(const char* what) const {
    return {"forgescan", "station", what, folder_.string()};
  }
  std::string Log() const { return ReadAll(folder_ / "log/supervisor.log"); }
  bool LogSays(const std::string& text, int times = 1) const {
    const auto count = [&] {
      int found = 0;
      const std::string log = Log();
      for (std::size_t at = log.find(text); at != std::string::npos; at = log.find(text, at + 1)) {
        ++found;
      }
      return found;
    };
    for (int turn = 0; turn < 1800 && count() < times; ++turn) {
      poll(nullptr, 0, 50);
    }
    return count() >= times;
  }
  // Every stage has been started, and the computing services are ready.
  bool IsUp(int times = 1) const {
    return LogSays("robot: is started", times) && LogSays("fusion: is ready", times) &&
           LogSays("report: is ready", times) && LogSays("recorder: is ready", times);
  }
  void Signal(const std::string& service, int signal) const {
    const pid_t pid = PidOfService(folder_, service);
    ASSERT_GT(pid, 0) << service;
    kill(pid, signal);
  }

  bool IsStopped(const std::string& service) const {
    const pid_t pid = PidOfService(folder_, service);
    const auto state = [pid] { return ReadProcessStat(pid).value_or(ProcessStat{}).state; };
    for (int turn = 0; turn < 600 && state() != 'T'; ++turn) {
      poll(nullptr, 0, 50);
    }
    return state() == 'T';
  }
  std::string File() const { return ReadAll(folder_ / "station.pid"); }
  const fs::path& folder() const { return folder_; }

 private:
  fs::path folder_;
};

// A service of the station that hangs does not end when its supervisor is killed, as the others do.
TEST_F(TwoStations, WhatOutlivesItsSupervisorIsEndedBeforeTheNextStart) {
  OneStation station(Folder(1), "orphans", "");
  const fs::path programs = base_ / "bin";  // a supervisor looks for programs beside its own
  fs::create_directories(programs);
  for (const auto& program : fs::directory_iterator(FORGESCAN_BIN_DIR)) {
    fs::create_symlink(program.path(), programs / program.path().filename());
  }
  fs::remove(programs / "forgescan");
  fs::copy_file(fs::path(FORGESCAN_BIN_DIR) / "forgescan", programs / "forgescan");
  std::ofstream(programs / "forgescan-deaf")
      << "#!/bin/sh\ntrap '' TERM\nfor second in $(seq 120); do sleep 1; done\n";
  fs::permissions(programs / "forgescan-deaf", fs::perms::owner_all);
  std::ofstream(station.folder() / "station.toml", std::ios::app) << "[service.deaf]\n";
  const std::string up = (programs / "forgescan").string() + " station up " + station.folder().string();

  RunCommand(up + " > /dev/null 2>&1 &");
  ASSERT_TRUE(station.IsUp()) << station.Log();
  const ProcessId hung = ProcessId::Of(PidOfService(station.folder(), "deaf"));
  ASSERT_GT(hung.pid, 0);
  kill(std::stoi(station.File()), SIGKILL);
  RunCommand(up + " > /dev/null 2>&1 &");
  EXPECT_TRUE(station.IsUp(2)) << station.Log();
  EXPECT_FALSE(hung.Runs());
  EXPECT_THAT(station.Log(), HasSubstr("deaf: process " + std::to_string(hung.pid) + " hangs: KILLED"));
  const auto down =
      RunCommand((programs / "forgescan").string() + " station down " + station.folder().string());
  EXPECT_EQ(down.exit_code, 1);
  EXPECT_THAT(down.text, HasSubstr("deaf had to be killed to stop"));
}

// It is the first of its stage: nothing of the rest is worth a start.
TEST_F(TwoStations, AServiceWithoutAProgramEndsTheStartAtOnce) {
  const OneStation station(Folder(1), "incomplete", "");
  std::ofstream(station.folder() / "station.toml", std::ios::app) << "[service.ghost]\n";
  Background up(station.Command("up"), base_ / "incomplete.txt");
  EXPECT_EQ(up.Wait(60), 1);
  EXPECT_THAT(up.Text(), HasSubstr("forgescan-ghost cannot be started"));
  EXPECT_THAT(station.Log(), HasSubstr("ghost: cannot work on this station"));
  EXPECT_THAT(station.Log(), ::testing::Not(HasSubstr("report: is started")));
}

TEST_F(TwoStations, WhatWasGivenUpOrFailedWhileItStoppedIsToldByAll) {
  const OneStation station(Folder(1), "frail", "restarts_max = 0\n");
  Background up(station.Command("up"), base_ / "frail_up.txt");
  ASSERT_TRUE(station.IsUp()) << station.Log();
  station.Signal("fusion", SIGKILL);
  ASSERT_TRUE(station.LogSays("fusion: IS GIVEN UP")) << station.Log();
  for (int turn = 0; turn < 600 && station.File().find("fusion 0 0 0 1\n") == std::string::npos; ++turn) {
    poll(nullptr, 0, 50);
  }
  const auto status = RunCommand(std::string(FORGESCAN_BIN_DIR) + "/forgescan station status --json " +
                                 station.folder().string());
  const auto json =
      nlohmann::json::parse(status.text.substr(0, status.text.rfind("}\n") + 1), nullptr, false);
  ASSERT_FALSE(json.is_discarded()) << status.text;
  EXPECT_EQ(json["fusion"]["given_up"], true);
  EXPECT_EQ(json["report"]["given_up"], false);

  station.Signal("recorder", SIGSTOP);  // it comes last, and crashes when it goes on
  ASSERT_TRUE(station.IsStopped("recorder"));
  station.Signal("recorder", SIGABRT);
  Background down(station.Command("down"), base_ / "frail_down.txt");
  ASSERT_TRUE(station.LogSays("station: is stopped")) << station.Log();
  station.Signal("recorder", SIGCONT);
  EXPECT_EQ(down.Wait(60), 1);
  EXPECT_EQ(up.Wait(60), 1);
  for (const std::string& text : {down.Text(), up.Text()}) {
    EXPECT_THAT(text, HasSubstr("fusion was given up; recorder was killed by signal 6"));
  }
}

TEST_F(TwoStations, AReaderOrATerminalThatGoesAwayLeavesTheOrderAsItIs) {
  const OneStation station(Folder(1), "alone", "");
  const std::string tool = std::string(FORGESCAN_BIN_DIR) + "/forgescan", code = (base_ / "code").string();
  std::signal(SIGHUP, SIG_DFL);  // this test itself may run under nohup
  RunCommand("{ { " + tool + " station up " + station.folder().string() + "; echo $? > " + code +
             "; } | head -n 1; } > /dev/null 2>&1 &");
  ASSERT_TRUE(station.IsUp()) << station.Log();
  kill(std::stoi(station.File()), SIGHUP);
  for (int turn = 0; turn < 1200 && ReadAll(code).empty(); ++turn) {
    poll(nullptr, 0, 50);
  }
  EXPECT_EQ(ReadAll(code), "1\n") << "in order, but standard output could not be written\n" << station.Log();
  EXPECT_THAT(station.Log(), HasSubstr("station: is down, 0 restarts"));
}

}  // namespace
}  // namespace forgescan::testing
