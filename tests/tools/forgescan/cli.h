// forgescan's offline commands as a user or a script calls them, in a folder of their own.
#pragma once

#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>

#include "services/common/geometry/cloud_io.h"
#include "tests/run_command.h"

namespace forgescan {

class Cli : public ::testing::Test {
 protected:
  void SetUp() override {
    folder_ = std::filesystem::path(::testing::TempDir()) / ("forgescan_cli_" + std::to_string(getpid()));
    std::filesystem::create_directories(folder_);
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }

  // What `arguments` redirect themselves is not in the output.
  CommandOutput Call(const std::string& arguments) const {
    const std::string command =
        "cd " + folder_.string() + " && " + FORGESCAN_BIN_DIR + "/forgescan " + arguments;
    return RunCommand(command);
  }
  // Fails with one sentence that contains `what`, and writes none of the files.
  void ExpectRefusal(const std::string& arguments, const std::string& what) const {
    const CommandOutput output = Call(arguments);
    EXPECT_NE(output.exit_code, 0) << arguments;
    EXPECT_NE(output.text.find(what), std::string::npos) << output.text;
    EXPECT_EQ(std::count(output.text.begin(), output.text.end(), '\n'), 1) << output.text;
    for (const char* file : {"out.ply", "out.json", "out.txt", "out.bundle"}) {
      EXPECT_FALSE(std::filesystem::exists(folder_ / file)) << arguments << " left " << file;
    }
  }
  void WriteCloud(const std::string& name, const std::vector<Eigen::Vector3f>& points) const {
    PointCloud cloud;
    cloud.points = points;
    ASSERT_TRUE(WritePly(folder_ / name, cloud).ok());
  }
  nlohmann::json ReadJson(const std::string& name) const {
    std::ifstream stream(folder_ / name);
    return nlohmann::json::parse(stream);
  }

  std::filesystem::path folder_;
};

}  // namespace forgescan
