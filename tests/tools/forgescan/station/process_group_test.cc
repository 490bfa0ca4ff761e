// Processes of a station: how they end, what they said last, and what is said of them.
#include "tools/forgescan/station/process_group.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <poll.h>
#include <unistd.h>

#include <csignal>
#include <filesystem>
#include <fstream>

#include "tools/forgescan/station/leftovers.h"
#include "tools/forgescan/station/network.h"
#include "tools/forgescan/station/supervisor_log.h"

namespace forgescan {
namespace {

namespace fs = std::filesystem;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::MatchesRegex;

class ProcessGroupTest : public ::testing::Test {
 protected:
  ProcessGroupTest() { fs::create_directories(folder_); }
  ~ProcessGroupTest() override { fs::remove_all(folder_); }
  Status Sh(const std::string& name, const std::string& script) {
    return group_.Start(name, {"/bin/sh", "-c", script});
  }
  // Between fork and exec it has the name of this program.
  static bool Becomes(pid_t pid, const std::string& program) {
    std::string name;
    for (int turn = 0; turn < 6000 && name != program; ++turn) {
      std::ifstream stream("/proc/" + std::to_string(pid) + "/comm");
      std::getline(stream, name);
      poll(nullptr, 0, 10);
    }
    return name == program;
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

  std::string Read(const char* name) const {
    std::ifstream stream(folder_ / name);
    return {std::istreambuf_iterator<char>(stream), {}};
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
  EXPECT_FALSE(group_.EndOf("one").has_value());
  EXPECT_FALSE(group_.EndOf("two").has_value()) << "that has been told";
}

TEST_F(ProcessGroupTest, TellsHowTheOneEndedThatIsAskedFor) {
  ASSERT_TRUE(Sh("one", "exit 0").ok());
  ASSERT_TRUE(Sh("two", "exec sleep 1000").ok());
  group_.Signal("two", SIGSEGV);
  std::optional<ProcessEnd> end;
  for (int turn = 0; turn < 6000 && !end; ++turn) {
    end = group_.EndOf("two");
    poll(nullptr, 0, 10);
  }
  ASSERT_TRUE(end.has_value());
  EXPECT_EQ(end->Text(), "was killed by signal 11");
  EXPECT_EQ(WaitForEnd().service, "one");
}

TEST_F(ProcessGroupTest, AProcessIsNotTakenForALaterOneWithItsNumber) {
  ASSERT_TRUE(Sh("one", "exec sleep 1000").ok());
  const ProcessId one = group_.IdOf("one");
  EXPECT_TRUE(one.Runs());
  EXPECT_FALSE((ProcessId{one.pid, one.started_ticks + 1}).Runs());
  group_.Signal("one", SIGKILL);
  WaitForEnd();
  EXPECT_FALSE(one.Runs());
  EXPECT_EQ(ProcessId::Of(one.pid), ProcessId{});
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
  EXPECT_EQ(started.error().message, "/no/such/program cannot be started: No such file or directory");
  EXPECT_FALSE(fs::exists(folder_ / "ghost.log"));
}

TEST_F(ProcessGroupTest, ALogThatCannotBeWrittenIsNamedWithItsReason) {
  ProcessGroup nowhere("/proc/no/such/folder");
  const Status started = nowhere.Start("shell", {"/bin/sh", "-c", "exit 0"});
  ASSERT_FALSE(started.ok());
  EXPECT_EQ(
      started.error().message,
      "/bin/sh is not started, as its log /proc/no/such/folder/shell.log cannot be written: No such file or "
      "directory");
}

// A service with the right name that does not end when it is asked to, as one that hangs.
TEST_F(ProcessGroupTest, WhatAnEarlierSupervisorLeftBehindIsEnded) {
  const std::string program = (folder_ / "forgescan-hung").string();
  fs::copy_file("/bin/sleep", program);
  ASSERT_TRUE(group_.Start("hung", {program, "1000"}).ok());
  ASSERT_TRUE(group_.Start("later", {program, "1000"}).ok());
  ASSERT_TRUE(Sh("stranger", "exec sleep 1000").ok());
  for (const char* name : {"hung", "later"}) {
    ASSERT_TRUE(Becomes(group_.PidOf(name), "forgescan-hung"));
  }
  group_.Signal("hung", SIGSTOP);
  ProcessId later = group_.IdOf("later");
  ++later.started_ticks;  // another process had that number
  SupervisionPolicy policy;
  policy.stop_patience_s = 0.2;
  auto log = SupervisorLog::Open(folder_.string(), Echo::kNothing);
  ASSERT_TRUE(log.ok());
  EXPECT_TRUE(EndLeftovers({{"hung", {group_.IdOf("hung"), 0, false}},
                            {"later", {later, 0, false}},
                            {"none", {}},
                            {"stranger", {group_.IdOf("stranger"), 0, false}}},
                           policy, *log)
                  .ok());
  const ProcessEnd end = WaitForEnd();
  EXPECT_EQ(end.service, "hung");
  EXPECT_EQ(end.Text(), "was killed by signal 9");
  EXPECT_TRUE(group_.IdOf("later").Runs());
  EXPECT_TRUE(group_.IdOf("stranger").Runs());
}

TEST_F(ProcessGroupTest, TheSupervisorsLogIsAppendedTo) {
  for (const char* text : {"is started", "was killed by signal 9"}) {
    auto log = SupervisorLog::Open(folder_.string(), Echo::kNothing);
    ASSERT_TRUE(log.ok());
    log->Write("fusion", text);
  }
  EXPECT_THAT(Read("supervisor.log"), MatchesRegex("[0-9-]+ [0-9:.]+ fusion: is started\n"
                                                   "[0-9-]+ [0-9:.]+ fusion: was killed by signal 9\n"));
  EXPECT_FALSE(SupervisorLog::Open("/proc/no/such/folder", Echo::kNothing).ok());
}

TEST_F(ProcessGroupTest, TheSupervisorsLogOutlivesAFullDisk) {
  fs::create_symlink("/dev/full", folder_ / "supervisor.log");
  auto log = SupervisorLog::Open(folder_.string(), Echo::kNothing);
  ASSERT_TRUE(log.ok());
  ::testing::internal::CaptureStderr();
  log->Write("fusion", "first");
  log->Write("fusion", "second");
  EXPECT_THAT(::testing::internal::GetCapturedStderr(), HasSubstr("fusion: second\n"));
  fs::remove(folder_ / "supervisor.log");  // there is room again
  log->Write("fusion", "third");
  log->Write("fusion", "fourth");
  EXPECT_THAT(Read("supervisor.log"),
              MatchesRegex("\n[0-9-]+ [0-9:.]+ supervisor: 2 lines could not be written here\n"
                           "[0-9-]+ [0-9:.]+ fusion: third\n[0-9-]+ [0-9:.]+ fusion: fourth\n"));
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
