// FOLDER/station.pid: who holds it, what others read in it, and what a crash leaves.
#include "tools/forgescan/station/station_lock.h"

#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <linux/filter.h>
#include <linux/seccomp.h>
#include <poll.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <cerrno>
#include <csignal>
#include <cstddef>
#include <filesystem>
#include <fstream>
#include <optional>
#include <thread>

#include "tools/forgescan/station/station_runner.h"

namespace forgescan {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;
constexpr double kPatienceS = 120;

// From now on this process asks in vain for locks, as on a file system that has none.
bool RefuseLocks() {
  const auto load = [](std::size_t at) {
    return sock_filter{BPF_LD | BPF_W | BPF_ABS, 0, 0, static_cast<std::uint32_t>(at)};
  };
  std::array<sock_filter, 6> rules{
      load(offsetof(seccomp_data, nr)),
      sock_filter{BPF_JMP | BPF_JEQ | BPF_K, 0, 3, SYS_fcntl},
      load(offsetof(seccomp_data, args[1])),  // its lower half
      sock_filter{BPF_JMP | BPF_JEQ | BPF_K, 0, 1, F_OFD_SETLK},
      sock_filter{BPF_RET | BPF_K, 0, 0, SECCOMP_RET_ERRNO | ENOLCK},
      sock_filter{BPF_RET | BPF_K, 0, 0, SECCOMP_RET_ALLOW},
  };
  const sock_fprog program{rules.size(), rules.data()};
  return prctl(PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0) == 0 &&
         prctl(PR_SET_SECCOMP, SECCOMP_MODE_FILTER, &program) == 0;
}

// While it lives no file takes a byte, as on a full disk.
class NoRoom {
 public:
  NoRoom() : old_action_(std::signal(SIGXFSZ, SIG_IGN)) {
    getrlimit(RLIMIT_FSIZE, &old_limit_);
    const rlimit nothing{0, old_limit_.rlim_max};
    setrlimit(RLIMIT_FSIZE, &nothing);
  }
  NoRoom(const NoRoom&) = delete;
  NoRoom& operator=(const NoRoom&) = delete;
  ~NoRoom() {
    setrlimit(RLIMIT_FSIZE, &old_limit_);
    std::signal(SIGXFSZ, old_action_);
  }

 private:
  void (*old_action_)(int);
  rlimit old_limit_{};
};

class StationLockTest : public ::testing::Test {
 protected:
  StationLockTest() { fs::create_directories(folder_); }
  ~StationLockTest() override { fs::remove_all(folder_); }
  bool IsUp() const { return RunningStation::Find(folder_.string()).ok(); }
  Result<StationLock> Take() const { return StationLock::Take(folder_.string(), kPatienceS); }
  // One that ends at its bus.
  void WriteStation() const {
    std::ofstream(folder_ / "station.toml")
        << "[station]\nname = \"cell\"\nbus = \"no bus\"\ncan = \"socketcan:can0\"\ncalibration = \"c\"\n"
        << "pattern = \"p\"\nviews = \"v\"\nmodel = \"m\"\nfeatures = \"f\"\nresults = \"r\"\n";
  }
  fs::path File() const { return folder_ / "station.pid"; }

  fs::path folder_ = fs::temp_directory_path() / ("forgescan-lock-" + std::to_string(getpid()));
};

TEST_F(StationLockTest, OnlyOneHoldsAStation) {
  EXPECT_FALSE(IsUp());
  {
    const auto lock = Take();
    ASSERT_TRUE(lock.ok()) << lock.error().message;
    const auto again = Take();
    ASSERT_FALSE(again.ok());
    EXPECT_THAT(again.error().message, HasSubstr("is up already"));
    EXPECT_TRUE(IsUp()) << "a refused one lets go of nothing";
  }
  EXPECT_FALSE(IsUp());
  EXPECT_TRUE(Take().ok());
}

TEST_F(StationLockTest, AFileThatCannotBeLockedIsNoStationThatIsUp) {
  int words[2];
  ASSERT_EQ(pipe(words), 0);
  const pid_t pid = fork();
  if (pid == 0) {
    const bool refused = RefuseLocks();
    const auto lock = Take();
    const std::string word = !refused ? "no filter" : lock.ok() ? "locked" : lock.error().message;
    _exit(write(words[1], word.data(), word.size()) > 0 ? 0 : 1);
  }
  close(words[1]);
  std::array<char, 1000> word{};
  EXPECT_GT(read(words[0], word.data(), word.size() - 1), 0);
  close(words[0]);
  EXPECT_EQ(waitpid(pid, nullptr, 0), pid);
  EXPECT_EQ(std::string(word.data()), File().string() + " cannot be locked: No locks available");
}

TEST_F(StationLockTest, OthersReadWhatIsWritten) {
  const auto lock = Take();
  ASSERT_TRUE(lock.ok());
  const ServiceProcesses written{{"fusion", {{1234, 99}, 2, false}}, {"report", {{0, 0}, 9, true}}};
  ASSERT_TRUE(lock->Write(written).ok());
  const auto running = RunningStation::Find(folder_.string());
  ASSERT_TRUE(running.ok());
  EXPECT_EQ(running->pid(), getpid());
  EXPECT_EQ(running->stop_patience_s(), kPatienceS);
  EXPECT_EQ(running->services(), written);
}

TEST_F(StationLockTest, AFileLeftBehindNamesNobodyButWhatMayStillRun) {
  {
    const auto lock = Take();
    ASSERT_TRUE(lock.ok());
    EXPECT_TRUE(lock->left_behind().empty());
    ASSERT_TRUE(lock->Write({{"robot", {{1234, 99}, 0, false}}}).ok());
    fs::copy_file(File(), folder_ / "crashed");
  }
  fs::rename(folder_ / "crashed", File());
  EXPECT_FALSE(IsUp()) << "nobody holds it, though its process runs";
  const auto lock = Take();
  ASSERT_TRUE(lock.ok());
  EXPECT_EQ(lock->left_behind().at("robot").process, (ProcessId{1234, 99}));
  EXPECT_TRUE(RunningStation::Find(folder_.string())->services().contains("robot"));
}

TEST_F(StationLockTest, AFullDiskKeepsNobodyFromHoldingAStation) {
  std::optional<NoRoom> no_room(std::in_place);
  const auto lock = Take();
  const auto again = Take();
  const bool found = IsUp();
  no_room.reset();
  ASSERT_TRUE(lock.ok()) << lock.error().message;
  ASSERT_FALSE(lock->named().ok());
  EXPECT_THAT(lock->named().error().message, HasSubstr("station.pid: cannot be written: "));
  EXPECT_FALSE(again.ok()) << "it holds";
  EXPECT_FALSE(found) << "it names nobody";
  EXPECT_TRUE(lock->Write({}).ok());
  EXPECT_TRUE(IsUp());
}

TEST_F(StationLockTest, AFullDiskKeepsNoStationFromStarting) {
  WriteStation();
  std::optional<NoRoom> no_room(std::in_place);
  const auto failed = StationRunner::Create(folder_.string(), Echo::kNothing);
  no_room.reset();
  ASSERT_FALSE(failed.ok());
  EXPECT_THAT(failed.error().message, HasSubstr("no bus")) << "it came as far as that";
}

// Whatever keeps a start from coming so far: the next one has to know them, too.
TEST_F(StationLockTest, AStartThatFailsForgetsNobodyThatMayStillRun) {
  WriteStation();
  std::ofstream(File()) << "4321 98 120\nrobot 1234 0 99 0\n";
  std::ofstream(folder_ / "log") << "no folder";
  for (int start = 0; start < 2; ++start) {
    const auto failed = StationRunner::Create(folder_.string(), Echo::kNothing);
    ASSERT_FALSE(failed.ok());
    EXPECT_THAT(failed.error().message, HasSubstr("supervisor.log: cannot be written"));
    EXPECT_FALSE(IsUp());
    const auto lock = Take();
    ASSERT_TRUE(lock.ok());
    ASSERT_TRUE(lock->left_behind().contains("robot")) << "start " << start;
    EXPECT_EQ(lock->left_behind().at("robot").process, (ProcessId{1234, 99}));
  }
  fs::remove(folder_ / "log");
  const auto failed = StationRunner::Create(folder_.string(), Echo::kNothing);
  ASSERT_FALSE(failed.ok());
  EXPECT_THAT(failed.error().message, HasSubstr("no bus"));
  EXPECT_FALSE(fs::exists(File())) << "there is no such process any more";
}

// What stands in the file between the lock and the first word is of the supervisor before; its number may be
// anybody's by now.
TEST_F(StationLockTest, ALockedFileThatNamesAnotherProcessIsNotBelieved) {
  const auto lock = Take();
  ASSERT_TRUE(lock.ok());
  std::ofstream(File()) << getppid() << " 1 120\n";
  EXPECT_FALSE(IsUp());
  std::ofstream(File()) << ProcessId::Of(getpid()).pid << " " << ProcessId::Of(getpid()).started_ticks
                        << " 120\n";
  EXPECT_TRUE(IsUp());
}

// Many look at once: none of them is taken for the one that runs the station.
TEST_F(StationLockTest, LookingTakesNoLock) {
  std::ofstream(File()) << ProcessId::Of(getpid()).pid << " " << ProcessId::Of(getpid()).started_ticks
                        << " 120\n";
  std::atomic<int> seen_up = 0;
  std::array<std::thread, 4> lookers;
  for (std::thread& looker : lookers) {
    looker = std::thread([&] {
      for (int i = 0; i < 2000; ++i) {
        seen_up += IsUp() ? 1 : 0;
      }
    });
  }
  for (std::thread& looker : lookers) {
    looker.join();
  }
  EXPECT_EQ(seen_up, 0);
}

// Stations that go down remove the file: a lock of a removed file holds nothing.
TEST_F(StationLockTest, ManyTakersOneHolder) {
  std::atomic<int> holders = 0, most = 0;
  std::array<std::thread, 4> takers;
  for (std::thread& taker : takers) {
    taker = std::thread([&] {
      for (int taken = 0; taken < 50;) {
        if (const auto lock = Take(); lock.ok()) {
          most = std::max(most.load(), ++holders);
          poll(nullptr, 0, 1);  // long enough for another one to come in
          --holders;
          ++taken;
        }
      }
    });
  }
  for (std::thread& taker : takers) {
    taker.join();
  }
  EXPECT_EQ(most, 1);
}

TEST_F(StationLockTest, WhoStoppedItReadsHowThatWent) {
  auto outcome_of = [this](const std::optional<Status>& said) {
    const auto lock = Take();
    const auto station = RunningStation::Find(folder_.string());
    EXPECT_TRUE(station.ok());
    EXPECT_TRUE(station->IsUp());
    if (said.has_value()) {
      EXPECT_TRUE(lock->WriteOutcome(*said).ok());
    }
    return station->Outcome();
  };
  EXPECT_TRUE(outcome_of(Status()).ok());
  const Status killed = outcome_of(Fail(ErrorCode::kUnavailable, "fusion had to be killed"));
  ASSERT_FALSE(killed.ok());
  EXPECT_EQ(killed.error().message, "fusion had to be killed");
  const Status crashed = outcome_of(std::nullopt);
  ASSERT_FALSE(crashed.ok());
  EXPECT_THAT(crashed.error().message, HasSubstr("without stopping its services in order"));
}

}  // namespace
}  // namespace forgescan
