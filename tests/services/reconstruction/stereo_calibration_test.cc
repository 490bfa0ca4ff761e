#include "services/common/imaging/stereo_calibration.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <limits>

namespace forgescan {
namespace {

using ::testing::HasSubstr;

std::string Matrix(const std::string& key, int rows, int cols, const std::string& data) {
  return fmt::format("{}: !!opencv-matrix\n   rows: {}\n   cols: {}\n   dt: d\n   data: [ {} ]\n", key, rows,
                     cols, data);
}

std::string GoodFile() {
  const std::string camera = "600., 0., 160., 0., 600., 120., 0., 0., 1.";
  return "%YAML:1.0\n---\n" + Matrix("Kl", 3, 3, camera) + Matrix("Dl", 1, 5, "0., 0., 0., 0., 0.") +
         Matrix("Kr", 3, 3, camera) + Matrix("Dr", 1, 5, "0., 0., 0., 0., 0.") +
         Matrix("R", 3, 3, "1., 0., 0., 0., 1., 0., 0., 0., 1.") + Matrix("T", 3, 1, "-100., 0., 0.") +
         "image_width: 320\nimage_height: 240\n";
}

Result<StereoCalibration> Load(const std::string& text) {
  const auto path =
      std::filesystem::temp_directory_path() / fmt::format("stereo_calibration_test.{}.yaml", getpid());
  std::ofstream(path) << text;
  auto calibration = LoadStereoCalibration(path);
  std::filesystem::remove(path);
  return calibration;
}

TEST(StereoCalibration, Starts) {
  const auto calibration = Load(GoodFile());
  ASSERT_TRUE(calibration.ok()) << calibration.error().message;
  EXPECT_EQ(calibration->right_from_left.translation_mm.x(), -100);
  EXPECT_EQ(calibration->image_size->height_px, 240);
  EXPECT_FALSE(calibration->projector.has_value());
}

TEST(StereoCalibration, CommentsMayHoldAnyMarks) {
  const auto calibration = Load(GoodFile() + "# ------- good to 5 %\n");
  EXPECT_TRUE(calibration.ok()) << calibration.error().message;
}

TEST(StereoCalibration, EveryWrongEntryIsNamed) {
  const std::vector<std::array<std::string, 3>> cases = {
      {"Kr:", "Kx:", "Kr is missing"},
      {"1., 0., 0., 0., 1., 0., 0., 0., 1.", "1., 0.1, 0., 0., 1., 0., 0., 0., 1.", "not a rotation"},
      {"1., 0., 0., 0., 1., 0., 0., 0., 1.", "1., 0., 0., 0., 1., 0., 0., 0., -1.", "not a rotation"},
      {"-100., 0., 0.", "0., 0., 0.", "baseline of the right camera is 0"},
      {"-100., 0., 0.", ".Nan, 0., 0.", "not finite"},
      {"600., 0., 160.", "-600., 0., 160.", "focal lengths of the left camera"},
      {"600., 0., 160.", "604., 0., 160.", "left camera are 604.0 and 600.0 px"},
      {"600., 0., 160.", "600., 0.5, 160.", "left camera holds 0.5 in row 1, column 2"},
      {"0., 600., 120.", "0.1, 600., 120.", "left camera holds 0.1 in row 2, column 1"},
      {"120., 0., 0., 1.", "120., 0., 0., 2.", "left camera holds 2 in row 3, column 3"},
      {"120., 0., 0., 1.", "120., 1e-3, 0., 1.", "left camera holds 0.001 in row 3, column 1"},
      {"image_width: 320", "image_width: -1", "positive whole numbers"},
      {"%YAML:1.0", "%YAML", "calibration file"},
  };
  for (const auto& [from, to, sentence] : cases) {
    std::string text = GoodFile();
    text.replace(text.find(from), from.size(), to);
    const auto calibration = Load(text);
    ASSERT_FALSE(calibration.ok()) << to;
    EXPECT_THAT(calibration.error().message, HasSubstr(sentence)) << to;
  }
  EXPECT_EQ(LoadStereoCalibration("/nonexistent.yaml").error().code, ErrorCode::kNotFound);
}

TEST(StereoCalibration, NoTruncationPassesForAWholeFile) {
  const std::string whole = GoodFile();
  for (std::size_t length = 0; length < whole.find("image_width"); length += 7) {
    EXPECT_FALSE(Load(whole.substr(0, length)).ok()) << length;
  }
}

}  // namespace
}  // namespace forgescan
