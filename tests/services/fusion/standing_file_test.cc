#include "services/fusion/standing_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <limits>

#include "services/common/input_file.h"
#include "tests/services/fusion/standing_scene.h"

namespace forgescan {
namespace {

using ::testing::HasSubstr;

constexpr StandingOrigin kOrigin{0x11223344, 0xaabbccdd};
constexpr std::size_t kCellBytes = 30;  // float x y z nx ny nz sigma_mm, ushort view

class StandingFileTest : public ::testing::Test {
 protected:
  StandingFileTest() {
    standing_.origin = kOrigin;
    standing_.scans = 3;
    standing_.views = {{}, SurfaceCells(testing::Corner(1), {}), SurfaceCells(testing::Plane(2), {})};
    EXPECT_TRUE(WriteStandingSurfaces(path_, standing_).ok());
    bytes_ = ReadInputFile(path_).value();
  }
  ~StandingFileTest() override { std::filesystem::remove(path_); }

  Result<StandingSurfaces> Load(const StandingOrigin& origin = kOrigin, std::size_t views = 3) const {
    return LoadStandingSurfaces(path_, origin, views);
  }
  // The sentence that refuses these bytes; it names the file.
  std::string Refusal(const std::string& bytes) const {
    std::ofstream(path_, std::ios::binary) << bytes;
    const auto standing = Load();
    EXPECT_FALSE(standing.ok());
    if (standing.ok()) return "";
    EXPECT_THAT(standing.error().message, HasSubstr(path_));
    return standing.error().message;
  }
  std::string WithText(const std::string& from, const std::string& to) const {
    std::string bytes = bytes_;
    return bytes.replace(bytes.find(from), from.size(), to);
  }
  // The column of a cell, 0 to 6, with another value.
  std::string WithValue(std::size_t cell, std::size_t column, float value) const {
    std::string bytes = bytes_;
    const std::size_t body = bytes.find("end_header\n") + std::strlen("end_header\n");
    std::memcpy(bytes.data() + body + cell * kCellBytes + 4 * column, &value, sizeof value);
    return bytes;
  }
  std::string WithView(std::size_t cell, std::uint16_t view) const {
    std::string bytes = bytes_;
    const std::size_t body = bytes.find("end_header\n") + std::strlen("end_header\n");
    std::memcpy(bytes.data() + body + cell * kCellBytes + 28, &view, sizeof view);
    return bytes;
  }

  const std::string path_ = ::testing::TempDir() + "/standing_file_test.ply";
  StandingSurfaces standing_;
  std::string bytes_;
};

TEST_F(StandingFileTest, KeepsWhatWasWritten) {
  const auto read = Load();
  ASSERT_TRUE(read.ok()) << read.error().message;
  EXPECT_EQ(read->origin, kOrigin);
  EXPECT_EQ(read->cell_rad, standing_.cell_rad);
  EXPECT_EQ(read->scans, 3);
  ASSERT_EQ(read->views.size(), 3U);
  EXPECT_TRUE(read->views[0].empty());
  for (std::size_t view = 1; view < 3; ++view) {
    const auto &now = read->views[view], &before = standing_.views[view];
    ASSERT_EQ(now.size(), before.size());
    for (std::size_t i = 0; i < now.size(); ++i) {
      EXPECT_EQ(now[i].key, before[i].key);
      EXPECT_LT((now[i].point - before[i].point).norm(), 1e-4);  // mm: float
      EXPECT_NEAR(now[i].variance_mm2, before[i].variance_mm2, 1e-6 * before[i].variance_mm2);
    }
  }
}

TEST_F(StandingFileTest, HoldsForOnePathAndOneCalibrationOnly) {
  EXPECT_THAT(Load({0x11223345, 0xaabbccdd}).error().message,
              HasSubstr("seen on the robot's path 11223344, the view matrices were taught on 11223345"));
  EXPECT_THAT(Load({0x11223344, 1}).error().message,
              HasSubstr("seen with the calibration aabbccdd, the station has 00000001"));
  EXPECT_THAT(Load(kOrigin, 2).error().message, HasSubstr("is of view 2, the path has views 0 to 1"));
}

TEST_F(StandingFileTest, RefusesWhatIsNoSuchFile) {
  EXPECT_THAT(Refusal(""), HasSubstr("end_header"));
  EXPECT_THAT(Refusal("recorded_body_degc = 31.5\n"), HasSubstr("PLY header"));
  EXPECT_THAT(Refusal(WithText("comment scans 3\n", "")), HasSubstr("\"comment scans NUMBER\""));
  EXPECT_THAT(Refusal(WithText("comment scans 3\n", "comment scans 3\ncomment scans 4\n")),
              HasSubstr("\"comment scans NUMBER\""));
  EXPECT_THAT(Refusal(WithText("scans 3", "scans 0")), HasSubstr("scans is 0, allowed 1 and up"));
  EXPECT_THAT(Refusal(WithText("scans 3", "scans x")), HasSubstr("\"comment scans NUMBER\""));
  EXPECT_THAT(Refusal(WithText("cell_rad 0.003", "cell_rad nan")),
              HasSubstr("cell_rad is nan, allowed 0.0001 to 0.1"));
  EXPECT_THAT(Refusal(WithText("path_crc32 ", "path_crc32 -")), HasSubstr("\"comment path_crc32 NUMBER\""));
  EXPECT_THAT(Refusal(bytes_.substr(0, bytes_.size() - 1)), HasSubstr("is cut off"));
  EXPECT_THAT(Refusal(bytes_ + "x"), HasSubstr("1 bytes follow the last row"));
  std::filesystem::resize_file(path_, 60'000'001);
  EXPECT_THAT(Load().error().message, HasSubstr("has 60000001 bytes, allowed are 60000000"));
  std::filesystem::remove(path_);
  EXPECT_EQ(Load().error().code, ErrorCode::kNotFound);
}

TEST_F(StandingFileTest, RefusesACellThatCannotBe) {
  constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
  EXPECT_THAT(Refusal(WithValue(5, 0, kNan)),
              HasSubstr("1 of its cells have a coordinate that is no number"));
  EXPECT_THAT(Refusal(WithValue(5, 2, -650)), HasSubstr("cell 5 is not in front of the camera"));
  EXPECT_THAT(Refusal(WithValue(5, 3, kNan)), HasSubstr("cell 5 has a normal whose length is not 1"));
  for (const float sigma_mm : {0.F, -0.01F, kNan, 2.F}) {
    EXPECT_THAT(Refusal(WithValue(5, 6, sigma_mm)), HasSubstr("cell 5 has a sigma_mm of "));
  }
  EXPECT_THAT(Refusal(WithView(5, 9)), HasSubstr("cell 5 is of view 9, the path has views 0 to 2"));
  EXPECT_THAT(Refusal(WithView(5, 0)),
              HasSubstr("cell 5 is not after the one before it by view and direction"));
  EXPECT_THAT(Refusal(WithValue(5, 1, -400)), HasSubstr("cell 5 is not after the one before it"));
  std::ofstream(path_, std::ios::binary) << bytes_;
  EXPECT_TRUE(Load().ok());
}

}  // namespace
}  // namespace forgescan
