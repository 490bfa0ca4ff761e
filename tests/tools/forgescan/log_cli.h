// forgescan log as a user or a script calls it, in a folder of its own.
#pragma once

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>

#include "services/common/log/log_reader.h"
#include "tests/run_command.h"
#include "tests/tools/forgescan/test_recording.h"

namespace forgescan {

class LogCli : public ::testing::Test {
 protected:
  void SetUp() override { std::filesystem::create_directories(folder_); }
  void TearDown() override { std::filesystem::remove_all(folder_); }

  CommandOutput Call(const std::string& arguments) const {
    const std::string command =
        "cd " + folder_.string() + " && " + FORGESCAN_BIN_DIR + "/forgescan log " + arguments;
    return RunCommand(command);
  }
  std::string Path(const std::string& name) const { return folder_ / name; }
  void Write(const TestRecording& recording, const std::string& name = "a.log") const {
    std::filesystem::remove(folder_ / name);
    recording.WriteTo(Path(name));
  }
  // Changes bytes of the file.
  void Patch(std::uint64_t at, const std::string& bytes) const {
    std::fstream file(folder_ / "a.log", std::ios::binary | std::ios::in | std::ios::out);
    file.seekp(static_cast<std::streamoff>(at));
    file << bytes;
  }
  void ExpectFinding(const std::string& what) const {
    const CommandOutput output = Call("check a.log");
    EXPECT_EQ(output.exit_code, 1) << output.text;
    EXPECT_THAT(output.text, ::testing::HasSubstr(what));
  }
  std::vector<std::string> Channels(const std::string& name) const {
    const auto log = LogReader::Open(Path(name));
    EXPECT_TRUE(log.ok());
    std::vector<std::string> channels;
    for (const LogEntry& entry : log.ok() ? log->entries() : std::vector<LogEntry>()) {
      channels.push_back(log->ChannelOf(entry));
    }
    return channels;
  }
  std::vector<std::string> Files(const std::string& folder) const {
    std::vector<std::string> names;
    for (const auto& entry : std::filesystem::directory_iterator(folder_ / folder)) {
      names.push_back(entry.path().filename());
    }
    std::sort(names.begin(), names.end());
    return names;
  }

  const std::filesystem::path folder_ =
      std::filesystem::path(::testing::TempDir()) / ("log_cli_" + std::to_string(getpid()));
};

}  // namespace forgescan
