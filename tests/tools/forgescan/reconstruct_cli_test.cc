// forgescan reconstruct as a user calls it, on real frames (not part of the repository; skipped where
// absent).
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <string>

#include "services/common/geometry/cloud_io.h"
#include "tests/common/real_data.h"
#include "tests/run_command.h"

namespace forgescan {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;

const fs::path kBoard = RealData("real-fringe-plane").value_or("");

class ReconstructCli : public ::testing::Test {
 protected:
  void SetUp() override {
    if (kBoard.empty()) {
      GTEST_SKIP() << "real-fringe-plane" << kNoRealData;
    }
    fs::create_directories(folder_);
    std::ofstream pattern(folder_ / "pattern.toml");
    pattern << "projector_width_px = 1280\nphase_origin_px = -1\nbackground = \"own\"\n";
    for (int j = 0; j < 3; ++j) {
      pattern << fmt::format("[[frequency]]\nperiod_px = {}\nshifts_deg = [0, 90, 180, 270]\n", 28 - 2 * j)
              << fmt::format("frames = [\"{:02}.png\", \"{:02}.png\", \"{:02}.png\", \"{:02}.png\"]\n",
                             1 + 12 * j, 4 + 12 * j, 7 + 12 * j, 10 + 12 * j);
    }
  }
  void TearDown() override { fs::remove_all(folder_); }

  // left, right: folders of the board's data; the outputs are options of their own.
  CommandOutput Call(const std::string& left, const std::string& right, const std::string& outputs) const {
    const std::string command = fmt::format(
        "cd {} && {}/forgescan reconstruct --left {} --right {} --calibration {} --pattern pattern.toml {}",
        folder_.string(), FORGESCAN_BIN_DIR, left, right, (kBoard / "stereo_params.yaml").string(), outputs);
    return RunCommand(command);
  }
  void ExpectOnlyThePattern() const {
    for (const auto& entry : fs::directory_iterator(folder_)) {
      EXPECT_EQ(entry.path().filename(), "pattern.toml");
    }
  }

  const fs::path folder_ =
      fs::path(::testing::TempDir()) / ("forgescan_reconstruct_" + std::to_string(getpid()));
  const std::string left_ = (kBoard / "L").string();
  const std::string right_ = (kBoard / "R").string();
};

TEST_F(ReconstructCli, WritesCloudAndFigures) {
  const CommandOutput output = Call(left_, right_, "--out c.ply --json q.json");
  ASSERT_EQ(output.exit_code, 0) << output.text;
  const auto cloud = ReadPointCloud(folder_ / "c.ply");
  ASSERT_TRUE(cloud.ok()) << cloud.error().message;
  EXPECT_GE(cloud->size(), 550000U);  // of about 603,600 by an independent reconstruction
  std::ifstream stream(folder_ / "q.json");
  const auto figures = nlohmann::json::parse(stream);
  EXPECT_EQ(figures["points"].get<std::size_t>(), cloud->size());
  // projector px; half of what exchanged or mirrored images show at least (0.16 px)
  EXPECT_LT(figures["projector_consistency"]["column_rms_px"].get<double>(), 0.08);
  EXPECT_TRUE(figures["left"]["clipping_dn"].is_null());
  EXPECT_EQ(std::distance(fs::directory_iterator(folder_), fs::directory_iterator()), 3);  // nothing else
}

TEST_F(ReconstructCli, ARefusalRemovesTheOldResult) {
  std::ofstream(folder_ / "c.ply") << "of yesterday";
  std::ofstream(folder_ / "q.json") << "of yesterday";
  const CommandOutput output = Call(right_, left_, "--out c.ply --json q.json");
  EXPECT_NE(output.exit_code, 0);
  EXPECT_THAT(output.text, HasSubstr("exchanged or mirrored"));
  ExpectOnlyThePattern();
}

TEST_F(ReconstructCli, WhenOneFileCannotBeWrittenThereIsNone) {
  const CommandOutput output = Call(left_, right_, "--out c.ply --json /dev/full");
  EXPECT_NE(output.exit_code, 0);
  EXPECT_THAT(output.text, HasSubstr("/dev/full"));
  ExpectOnlyThePattern();
}

TEST_F(ReconstructCli, OutputsMustNotBeInputsOrEachOther) {
  const CommandOutput over_input = Call(left_, right_, "--out ./pattern.toml");
  EXPECT_NE(over_input.exit_code, 0);
  EXPECT_THAT(over_input.text, HasSubstr("is both input and output"));
  EXPECT_GT(fs::file_size(folder_ / "pattern.toml"), 100U);
  fs::create_symlink("pattern.toml", folder_ / "link.ply");
  EXPECT_THAT(Call(left_, right_, "--out link.ply").text, HasSubstr("is both input and output"));
  fs::remove(folder_ / "link.ply");
  EXPECT_THAT(Call(left_, right_, "--out c --json ../" + folder_.filename().string() + "/c").text,
              HasSubstr("two outputs"));
  EXPECT_THAT(Call(left_, right_, "--out .").text, HasSubstr("is a folder"));
  EXPECT_THAT(Call(left_, right_, "--out nowhere/c.ply").text, HasSubstr("folder does not exist"));
  EXPECT_THAT(Call(".", right_, "--out c.ply").text, HasSubstr("into the input folder"));
  ExpectOnlyThePattern();
}

}  // namespace
}  // namespace forgescan
