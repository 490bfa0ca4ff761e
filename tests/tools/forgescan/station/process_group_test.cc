// Processes of a station: how they end, and what they said last; the file that names them while they run.
#include "tools/forgescan/station/process_group.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <poll.h>
#include <unistd.h>

#include <csignal>
#include <filesystem>
#include <fstream>

#include "tools/forgescan/station/network.h"
#include "tools/forgescan/station/station_lock.h"
#include "tools/forgescan/station/supervisor_log.h"

namespace forgescan {
namespace {

namespace fs = std::filesystem;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

class ProcessGroupTest : public ::testing::Test {
 protected:
  ProcessGroupTest() { fs::create_directories(folder_); }
  ~ProcessGroupTest() override { fs::remove_all(folder_); }
  Status Sh(const std::string& name, const std::string& script) {
    return group_.Start(name, {"/bin/sh", "-c", script});
  }
  ProcessEnd WaitForEnd() {
    for (int turn = 0; turn < 6000; ++turn) {
      if (auto end = group_.Ended()) {
        return *end;
      }
      poll(nullptr, 0, 10);
    }
    return {"nobody within a minute", false, 0, ""};
  }

  fs::path folder_ = fs::temp_directory_path() / ("forgescan-processes-" + std::to_string(getpid()));
  ProcessGroup group_{folder_.string()};
};

TEST_F(ProcessGroupTest, TellsExitCodeAndLastWords) {
  ASSERT_TRUE(Sh("loud", "echo first; echo the last word; echo; exit 3").ok());
  EXPECT_GT(group_.PidOf("loud"), 0);
  const ProcessEnd end = WaitForEnd();
  EXPECT_EQ(end.service, "loud");
  EXPECT_EQ(end.Text(), "ended with exit code 3: the last word");
  EXPECT_EQ(group_.PidOf("loud"), 0);
  EXPECT_FALSE(group_.Ended().has_value());
}

TEST_F(ProcessGroupTest, TellsASignalAndNamesTheRightOne) {
  ASSERT_TRUE(Sh("one", "exec sleep 1000").ok());
  ASSERT_TRUE(Sh("two", "exec sleep 1000").ok());
  group_.Signal("two", SIGSEGV);
  EXPECT_EQ(WaitForEnd().Text(), "was killed by signal 11");
  EXPECT_GT(group_.PidOf("one"), 0);
  EXPECT_FALSE(group_.Reaped("one"));
  EXPECT_TRUE(group_.Reaped("two"));
  EXPECT_TRUE(group_.Reaped("never there"));
}

TEST_F(ProcessGroupTest, FindsTheLastWordsOfALongLog) {
  std::ofstream log(folder_ / "long.log");
  for (int i = 0; i < 100'000; ++i) {
    log << "line " << i << "\n";
  }
  log.close();
  ASSERT_TRUE(Sh("long", "echo the very last").ok());
  EXPECT_EQ(WaitForEnd().last_words, "the very last");
}

TEST_F(ProcessGroupTest, AProgramThatIsNotThereIsAnError) {
  const Status started = group_.Start("ghost", {"/no/such/program"});
  ASSERT_FALSE(started.ok());
  EXPECT_THAT(started.error().message, HasSubstr("/no/such/program cannot be started"));
}

TEST_F(ProcessGroupTest, OnlyOneHoldsAStation) {
  EXPECT_FALSE(RunningStation(folder_.string()).ok());
  {
    const auto lock = StationLock::Take(folder_.string());
    ASSERT_TRUE(lock.ok()) << lock.error().message;
    ASSERT_TRUE(lock->Write({{"fusion", {1234, 2}}, {"report", {0, 0}}}).ok());
    const auto again = StationLock::Take(folder_.string());
    ASSERT_FALSE(again.ok());
    EXPECT_THAT(again.error().message, HasSubstr("is up already"));
    const auto running = RunningStation(folder_.string());
    ASSERT_TRUE(running.ok());
    EXPECT_EQ(running->pid, getpid());
    EXPECT_EQ(running->services.at("fusion").pid, 1234);
    EXPECT_EQ(running->services.at("fusion").restarts, 2);
  }
  EXPECT_FALSE(RunningStation(folder_.string()).ok());
  std::ofstream(folder_ / "station.pid") << getpid() << "\n";  // left behind by a crash
  EXPECT_FALSE(RunningStation(folder_.string()).ok()) << "nobody holds it";
}

TEST_F(ProcessGroupTest, TheSupervisorsLogIsAppendedTo) {
  for (const char* text : {"is started", "was killed by signal 9"}) {
    auto log = SupervisorLog::Open(folder_.string(), Echo::kNothing);
    ASSERT_TRUE(log.ok());
    log->Write("fusion", text);
  }
  std::ifstream stream(folder_ / "supervisor.log");
  const std::string text{std::istreambuf_iterator<char>(stream), {}};
  EXPECT_THAT(text, ::testing::MatchesRegex("[0-9-]+ [0-9:.]+ fusion: is started\n"
                                            "[0-9-]+ [0-9:.]+ fusion: was killed by signal 9\n"));
  EXPECT_FALSE(SupervisorLog::Open("/proc/no/such/folder", Echo::kNothing).ok());
}

TEST(Network, KnowsTheGroupsOfAStation) {
  Station station;
  station.bus_url = "udpm://239.255.76.68:7668?ttl=0";
  station.can_url = "udp:239.74.163.2:43114?hops=1";
  EXPECT_THAT(GroupsOf(station), ElementsAre("239.255.76.68", "239.74.163.2"));
  station.can_url = "socketcan:can0";
  EXPECT_THAT(GroupsOf(station), ElementsAre("239.255.76.68"));
}

}  // namespace
}  // namespace forgescan
