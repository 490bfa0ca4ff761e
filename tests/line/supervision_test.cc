// What a station's supervisor does when its services cannot work, hang or crash, and when it goes itself.
#include <poll.h>

#include <csignal>
#include <nlohmann/json.hpp>

#include "tests/line/two_stations.h"
#include "tools/forgescan/station/process_id.h"

namespace forgescan::testing {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;

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
