// forgescan calibration as a user calls it: tables, exit codes, a file only for a refinement that is trusted.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <fstream>
#include <nlohmann/json.hpp>

#include "services/common/imaging/stereo_calibration_text.h"
#include "services/common/input_file.h"
#include "services/fusion/standing_file.h"
#include "tests/common/calibration/bar_scene.h"
#include "tests/run_command.h"

namespace forgescan {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;

constexpr double kBarMm = 125.0123;

class CalibrationCli : public ::testing::Test {
 protected:
  void SetUp() override {
    fs::create_directories(folder_);
    Write("stereo.yaml", StereoCalibrationText(written_));
    Write("bar.toml", PlacementsText(MeasuredBar(written_, kBarMm, 0.002), kBarMm));
  }
  void TearDown() override { fs::remove_all(folder_); }

  void Write(const char* name, const std::string& text) const { std::ofstream(folder_ / name) << text; }
  CommandOutput Call(const std::string& arguments) const {
    return RunCommand(
        fmt::format("cd {} && {}/forgescan calibration {}", folder_.string(), FORGESCAN_BIN_DIR, arguments));
  }
  CommandOutput Refine() const {
    return Call("refine --calibration stereo.yaml --placements bar.toml --out new.yaml --json new.json");
  }

  const fs::path folder_ = fs::path(::testing::TempDir()) / fmt::format("calibration_cli_{}", getpid());
  const StereoCalibration written_ = Corrected(TrueRig(), SomeError());
};

TEST_F(CalibrationCli, RefinesAndPrintsWhatItDid) {
  const CommandOutput output = Refine();
  ASSERT_EQ(output.exit_code, 0) << output.text;
  EXPECT_THAT(output.text, HasSubstr("P16 "));
  EXPECT_THAT(output.text, HasSubstr("translation z"));
  EXPECT_THAT(output.text, HasSubstr("directions the lengths determine"));
  const auto refined = LoadStereoCalibration(folder_ / "new.yaml");
  ASSERT_TRUE(refined.ok()) << refined.error().message;
  ASSERT_TRUE(refined->projector && refined->image_size);
  const auto json = nlohmann::json::parse(std::ifstream(folder_ / "new.json"));
  EXPECT_EQ(json["placements"].size(), 16u);
  const double correction = json["parameters"][0]["correction"];
  EXPECT_NEAR(refined->left.camera_matrix(0, 0), written_.left.camera_matrix(0, 0) + correction, 1e-9);
  EXPECT_NE(correction, 0);
  EXPECT_THAT(output.text, HasSubstr("certified length"));
  EXPECT_EQ(json["certificate"]["prior_sigma_mm"], 0.0005);
  EXPECT_LE(json["certificate"]["sigma_mm"], 0.0005);
  EXPECT_NE(json["certificate"]["correction_mm"], 0);
}

TEST_F(CalibrationCli, WritesWhatItReads) {
  ASSERT_EQ(Refine().exit_code, 0);
  const std::string text = ReadInputFile(folder_ / "new.yaml").value();
  EXPECT_EQ(StereoCalibrationText(*LoadStereoCalibration(folder_ / "new.yaml")), text);
}

TEST_F(CalibrationCli, CheckTellsTheSphereSpacingError) {
  CommandOutput output = Call("check --calibration stereo.yaml --placements bar.toml --max-error-mm 0.2");
  EXPECT_EQ(output.exit_code, 0) << output.text;
  EXPECT_THAT(output.text, HasSubstr("sphere-spacing error SD: 0.0"));
  output = Call("check --calibration stereo.yaml --placements bar.toml --max-error-mm 0.01");
  EXPECT_EQ(output.exit_code, 1) << output.text;
  EXPECT_THAT(output.text, HasSubstr("allowed 0.0100 mm"));
}

TEST_F(CalibrationCli, ARefusalLeavesNoFile) {
  std::vector<BarPlacement> placements = MeasuredBar(written_, kBarMm, 0.002);
  placements[3].center_in_camera[0].x() += 0.1;
  Write("bar.toml", PlacementsText(placements, kBarMm));
  const CommandOutput output = Refine();
  EXPECT_EQ(output.exit_code, 1);
  EXPECT_THAT(output.text, HasSubstr("forgescan: placement P4 does not fit the others"));
  EXPECT_FALSE(fs::exists(folder_ / "new.yaml") || fs::exists(folder_ / "new.json"));
  Write("bar.toml", PlacementsText(MeasuredBar(written_, kBarMm, 0.002), kBarMm));
  EXPECT_EQ(Refine().exit_code, 0);
}

TEST_F(CalibrationCli, ARefusalLeavesWhatAnEarlierCallWrote) {
  ASSERT_EQ(Refine().exit_code, 0);
  const std::string yaml = ReadInputFile(folder_ / "new.yaml").value();
  const std::string json = ReadInputFile(folder_ / "new.json").value();
  std::vector<BarPlacement> placements = MeasuredBar(written_, kBarMm, 0.002);
  placements[3].center_in_camera[0].x() += 0.1;
  Write("bar.toml", PlacementsText(placements, kBarMm));
  ASSERT_EQ(Refine().exit_code, 1);
  ASSERT_TRUE(fs::exists(folder_ / "new.yaml") && fs::exists(folder_ / "new.json"));
  EXPECT_EQ(ReadInputFile(folder_ / "new.yaml").value(), yaml);
  EXPECT_EQ(ReadInputFile(folder_ / "new.json").value(), json);
}

TEST_F(CalibrationCli, PointsOfAnotherCalibrationAreRefused) {
  const std::string text = PlacementsText(MeasuredBar(written_, kBarMm, 0.002), kBarMm);
  Write("bar.toml", fmt::format("calibration_crc32 = {}\n{}", *Crc32OfFile(folder_ / "stereo.yaml"), text));
  const CommandOutput good = Refine();
  EXPECT_EQ(good.exit_code, 0) << good.text;
  const CommandOutput check = Call("check --calibration new.yaml --placements bar.toml --max-error-mm 0.2");
  EXPECT_EQ(check.exit_code, 1);
  EXPECT_THAT(check.text, HasSubstr(fmt::format("new.yaml has {}", *Crc32OfFile(folder_ / "new.yaml"))));
  Write("bar.toml", "calibration_crc32 = 7\n" + text);
  const CommandOutput other = Refine();
  EXPECT_EQ(other.exit_code, 1);
  EXPECT_THAT(other.text, HasSubstr("bar.toml: the placements were measured with the calibration of "
                                    "calibration_crc32 7, stereo.yaml has"));
}

TEST_F(CalibrationCli, RepeatsOfOnePlaceAreRefused) {
  std::vector<BarPlacement> placements = MeasuredBar(written_, kBarMm, 0.002);
  placements.push_back(placements[2]);
  placements.back().name = "again";
  Write("bar.toml", PlacementsText(placements, kBarMm));
  for (const CommandOutput& output :
       {Refine(), Call("check --calibration stereo.yaml --placements bar.toml --max-error-mm 0.2")}) {
    EXPECT_EQ(output.exit_code, 1);
    EXPECT_THAT(output.text, HasSubstr("placements P3 and again are one place"));
  }
}

TEST_F(CalibrationCli, NeverWritesOverWhatItReads) {
  const std::string before = ReadInputFile(folder_ / "stereo.yaml").value();
  const CommandOutput output =
      Call("refine --calibration stereo.yaml --placements bar.toml --out ./stereo.yaml");
  EXPECT_EQ(output.exit_code, 1) << output.text;
  EXPECT_EQ(ReadInputFile(folder_ / "stereo.yaml").value(), before);
}

}  // namespace
}  // namespace forgescan
