// tools/setup-host on the files of another system: nothing of this computer is touched.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <array>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>

namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;

struct Output {
  int exit_code = -1;
  std::string text;
};

class SetupHost : public ::testing::Test {
 protected:
  SetupHost() : root_(fs::path(::testing::TempDir()) / ("forgescan_host_" + std::to_string(getpid()))) {
    fs::remove_all(root_);
    fs::create_directories(root_);
  }
  ~SetupHost() override { fs::remove_all(root_); }

  Output Call(const std::string& arguments) const {
    Output output;
    const std::string command = FORGESCAN_SOURCE_DIR "/tools/setup-host " + arguments + " 2>&1";
    FILE* pipe = popen(command.c_str(), "r");
    std::array<char, 4096> buffer{};
    while (std::fgets(buffer.data(), buffer.size(), pipe) != nullptr) {
      output.text += buffer.data();
    }
    output.exit_code = WEXITSTATUS(pclose(pipe));
    return output;
  }
  Output CallOnRoot(const std::string& option = "") const {
    return Call(option + " --root " + root_.string());
  }
  std::string Read(const char* path) const {
    std::ifstream stream(root_ / path);
    return {std::istreambuf_iterator<char>(stream), {}};
  }

  fs::path root_;
};

TEST_F(SetupHost, WritesEveryFileOnceAndChecksIt) {
  const Output before = CallOnRoot("--check");
  EXPECT_EQ(before.exit_code, 1);
  EXPECT_THAT(before.text, HasSubstr("missing: /etc/sysctl.d/60-forgescan.conf"));
  EXPECT_TRUE(fs::is_empty(root_)) << "--check wrote something";

  const Output first = CallOnRoot();
  EXPECT_EQ(first.exit_code, 0) << first.text;
  EXPECT_THAT(first.text, HasSubstr("written: /etc/sysctl.d/60-forgescan.conf"));
  EXPECT_THAT(Read("etc/sysctl.d/60-forgescan.conf"), HasSubstr("net.core.rmem_max = 134217728\n"));
  EXPECT_THAT(Read("etc/systemd/system/forgescan-route.service"), HasSubstr("239.255.76.67/32 dev lo\n"));

  const Output second = CallOnRoot();
  EXPECT_EQ(second.exit_code, 0);
  EXPECT_EQ(second.text, "") << "it wrote again what was there";
  EXPECT_EQ(CallOnRoot("--check").exit_code, 0);
}

TEST_F(SetupHost, MendsAFileThatWasChanged) {
  ASSERT_EQ(CallOnRoot().exit_code, 0);
  std::ofstream(root_ / "etc/sysctl.d/60-forgescan.conf") << "net.core.rmem_max = 1\n";
  const Output check = CallOnRoot("--check");
  EXPECT_EQ(check.exit_code, 1);
  EXPECT_EQ(check.text, "missing: /etc/sysctl.d/60-forgescan.conf\n");
  EXPECT_EQ(CallOnRoot().text, "written: /etc/sysctl.d/60-forgescan.conf\n");
  EXPECT_EQ(CallOnRoot("--check").exit_code, 0);
}

TEST_F(SetupHost, RefusesWhatItDoesNotKnow) {
  EXPECT_EQ(Call("--root").exit_code, 2);
  EXPECT_EQ(Call("--root /nowhere/at/all").exit_code, 2);
  EXPECT_THAT(Call("--fast").text, HasSubstr("usage: setup-host"));
}

}  // namespace
