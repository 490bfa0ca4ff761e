// tools/setup-host on the files of another system, and what tools/spy makes of a station: nothing of this
// computer is touched.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <iterator>
#include <sstream>
#include <string>

#include "tests/run_command.h"

namespace {

namespace fs = std::filesystem;
using forgescan::CommandOutput;
using forgescan::RunCommand;
using ::testing::HasSubstr;

class SetupHost : public ::testing::Test {
 protected:
  SetupHost() : root_(fs::path(::testing::TempDir()) / ("forgescan_host_" + std::to_string(getpid()))) {
    fs::remove_all(root_);
    fs::create_directories(root_);
  }
  ~SetupHost() override { fs::remove_all(root_); }

  CommandOutput Call(const std::string& arguments) const { return Run("setup-host " + arguments); }
  static CommandOutput Run(const std::string& tool) {
    const std::string command = FORGESCAN_SOURCE_DIR "/tools/" + tool;
    return RunCommand(command);
  }
  CommandOutput CallOnRoot(const std::string& option = "") const {
    return Call(option + " --root " + root_.string());
  }
  std::string Read(const char* path) const {
    std::ifstream stream(root_ / path);
    return {std::istreambuf_iterator<char>(stream), {}};
  }

  fs::path root_;
};

TEST_F(SetupHost, WritesEveryFileOnceAndChecksIt) {
  const CommandOutput before = CallOnRoot("--check");
  EXPECT_EQ(before.exit_code, 1);
  EXPECT_THAT(before.text, HasSubstr("missing: /etc/sysctl.d/60-forgescan.conf"));
  EXPECT_TRUE(fs::is_empty(root_)) << "--check wrote something";

  const CommandOutput first = CallOnRoot();
  EXPECT_EQ(first.exit_code, 0) << first.text;
  EXPECT_THAT(first.text, HasSubstr("written: /etc/sysctl.d/60-forgescan.conf"));
  EXPECT_THAT(Read("etc/sysctl.d/60-forgescan.conf"), HasSubstr("net.core.rmem_max = 134217728\n"));
  EXPECT_THAT(Read("etc/systemd/system/forgescan-route.service"), HasSubstr("239.255.76.67/32 dev lo\n"));

  const CommandOutput second = CallOnRoot();
  EXPECT_EQ(second.exit_code, 0);
  EXPECT_EQ(second.text, "") << "it wrote again what was there";
  EXPECT_EQ(CallOnRoot("--check").exit_code, 0);
}

TEST_F(SetupHost, MendsAFileThatWasChanged) {
  ASSERT_EQ(CallOnRoot().exit_code, 0);
  std::ofstream(root_ / "etc/sysctl.d/60-forgescan.conf") << "net.core.rmem_max = 1\n";
  const CommandOutput check = CallOnRoot("--check");
  EXPECT_EQ(check.exit_code, 1);
  EXPECT_EQ(check.text, "missing: /etc/sysctl.d/60-forgescan.conf\n");
  EXPECT_EQ(CallOnRoot().text, "written: /etc/sysctl.d/60-forgescan.conf\n");
  EXPECT_EQ(CallOnRoot("--check").exit_code, 0);
}

TEST_F(SetupHost, EnablesTheRouteForTheNextBoot) {
  const char* link = "etc/systemd/system/multi-user.target.wants/forgescan-route.service";
  EXPECT_THAT(CallOnRoot().text, HasSubstr("enabled: forgescan-route.service\n"));
  EXPECT_EQ(fs::read_symlink(root_ / link), "/etc/systemd/system/forgescan-route.service");
  fs::remove(root_ / link);
  const CommandOutput check = CallOnRoot("--check");
  EXPECT_EQ(check.exit_code, 1);
  EXPECT_THAT(check.text, HasSubstr("forgescan-route.service is not enabled"));
  EXPECT_EQ(CallOnRoot().text, "enabled: forgescan-route.service\n");
  EXPECT_EQ(CallOnRoot("--check").exit_code, 0);
}

TEST_F(SetupHost, LowersNoBufferThatAnotherFileMakesLarger) {
  fs::create_directories(root_ / "etc/sysctl.d");
  std::ofstream(root_ / "etc/sysctl.d/50-other.conf")
      << "# net.core.rmem_max = 999999999\nnet.core.rmem_default=8388608\n-net/core/rmem_max = 268435456";
  ASSERT_EQ(CallOnRoot().exit_code, 0);
  EXPECT_THAT(Read("etc/sysctl.d/60-forgescan.conf"), HasSubstr("net.core.rmem_max = 268435456\n"));
  EXPECT_THAT(Read("etc/sysctl.d/60-forgescan.conf"), HasSubstr("net.core.rmem_default = 16777216\n"));
  EXPECT_EQ(CallOnRoot("--check").exit_code, 0);
}

TEST_F(SetupHost, RefusesWhatItDoesNotKnow) {
  EXPECT_EQ(Call("--root").exit_code, 2);
  EXPECT_EQ(Call("--root /nowhere/at/all").exit_code, 2);
  EXPECT_THAT(Call("--fast").text, HasSubstr("usage: setup-host"));
}

// tools/spy without its viewer: which bus it would listen to, and where.
class Spy : public SetupHost {
 protected:
  std::string AddressOf(const std::string& bus) const {
    std::ofstream(root_ / "station.toml")
        << "[station]\nname = \"x\"\nbus = \"" << bus << "\"   # a comment\n";
    return Run("spy --address " + root_.string()).text;
  }
};

TEST_F(Spy, LeavesTheReceiveBufferOutOfTheAddress) {
  const std::string bus = "udpm://239.255.76.68:7668";
  EXPECT_EQ(AddressOf(bus), bus + "\n239.255.76.68\n");
  EXPECT_EQ(AddressOf(bus + "?ttl=0"), bus + "?ttl=0\n239.255.76.68\n");
  EXPECT_EQ(AddressOf(bus + "?recv_buf_size=104857600"), bus + "\n239.255.76.68\n");
  EXPECT_EQ(AddressOf(bus + "?recv_buf_size=1&ttl=0"), bus + "?ttl=0\n239.255.76.68\n");
  EXPECT_EQ(AddressOf(bus + "?ttl=0&recv_buf_size=1"), bus + "?ttl=0\n239.255.76.68\n");
}

TEST_F(Spy, NamesAStationThatIsNotThere) {
  const CommandOutput none = Run("spy --address " + root_.string());
  EXPECT_EQ(none.exit_code, 2);
  EXPECT_THAT(none.text, HasSubstr("station.toml"));
}

// A process number that a crash left in the file may be anybody's.
TEST_F(Spy, JoinsTheNetworkOfALivingSupervisorOnly) {
  const std::string stat = [] {
    std::ifstream stream("/proc/self/stat");
    return std::string(std::istreambuf_iterator<char>(stream), {});
  }();
  std::istringstream fields(stat.substr(stat.rfind(')') + 1));
  std::string ticks;
  for (int field = 3; field <= 22; ++field) {
    fields >> ticks;
  }
  AddressOf("udpm://239.1.2.3:7667");
  const auto supervisor = [&](const std::string& started) {
    std::ofstream(root_ / "station.pid") << getpid() << " " << started << " 120\nfusion 0 0 0 0\n";
    return Run("spy --supervisor " + root_.string());
  };
  EXPECT_EQ(supervisor(ticks).text, std::to_string(getpid()) + "\n");
  EXPECT_EQ(supervisor("1").exit_code, 1);
  EXPECT_EQ(supervisor("").exit_code, 1);
}

}  // namespace
