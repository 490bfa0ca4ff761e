#include "services/common/calibration/placements_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include "services/common/geometry/cloud_io.h"

namespace forgescan {
namespace {

using ::testing::HasSubstr;
namespace fs = std::filesystem;

constexpr char kGood[] = R"(distance_mm = 125.0123
expanded_uncertainty_mm = 0.001
ball_radius_mm = 19.05
volume_mm = [240, 240, 160]
center_sigma_mm = 0.002
[prior]
focal_px = 0.5
k1 = 0
[[placement]]
name = "low"
center_1_mm = [10, 20, 650]
center_2_mm = [135, 20, 650]
)";

std::string Refusal(std::string text, const std::string& from, const std::string& to) {
  text.replace(text.find(from), from.size(), to);
  const auto file = ParsePlacements(text, "bar.toml", "");
  return file.ok() ? "accepted" : file.error().message;
}

// The part of a ball that a camera at the origin sees.
void AppendBall(const Eigen::Vector3d& center, double radius_mm, PointCloud& cloud) {
  for (int i = 0; i < 4000; ++i) {
    const double z = 1 - 2 * (i + 0.5) / 4000, around = 2.399963 * i;
    const double r = std::sqrt(1 - z * z);
    const Eigen::Vector3d out(r * std::cos(around), r * std::sin(around), z);
    if (out.dot(center) < 0) cloud.points.push_back((center + radius_mm * out).cast<float>());
  }
}

TEST(PlacementsFile, ReadsBarPriorAndCentres) {
  const auto file = ParsePlacements(kGood, "bar.toml", "");
  ASSERT_TRUE(file.ok()) << file.error().message;
  EXPECT_EQ(file->bar.distance_mm, 125.0123);
  EXPECT_EQ(file->bar.distance_sigma_mm, 0.0005);  // k = 2
  EXPECT_EQ(file->options.prior.focal_px, 0.5);
  EXPECT_EQ(file->options.prior.center_px, CalibrationPrior().center_px);
  EXPECT_EQ(file->options.prior.k1, 0);
  EXPECT_EQ(file->options.placements.volume_mm, Eigen::Vector3d(240, 240, 160));
  const auto placements = MeasurePlacements(*file);
  ASSERT_TRUE(placements.ok()) << placements.error().message;
  ASSERT_EQ(placements->size(), 1u);
  EXPECT_EQ(placements->front().DistanceMm(), 125);
  EXPECT_EQ(placements->front().center_sigma_mm, 0.002);
}

TEST(PlacementsFile, FitsCentresInClouds) {
  const fs::path folder = fs::temp_directory_path() / fmt::format("placements_file_test.{}", getpid());
  fs::create_directory(folder);
  const Eigen::Vector3d first(10.5, 20.25, 640), second(130, 18, 655);
  PointCloud cloud;
  AppendBall(first, 19.05, cloud);
  AppendBall(second, 19.05, cloud);
  ASSERT_TRUE(WritePly(folder / "low.ply", cloud).ok());
  std::string text = fmt::format("calibration_crc32 = 4294967295\n{}", kGood);
  text = text.substr(0, text.find("center_1_mm")) +
         "cloud = \"low.ply\"\nnear_1_mm = [13, 18, 642]\nnear_2_mm = [128, 20, 652]\n";
  const auto file = ParsePlacements(text, "bar.toml", folder);
  ASSERT_TRUE(file.ok()) << file.error().message;
  const auto placements = MeasurePlacements(*file);
  ASSERT_TRUE(placements.ok()) << placements.error().message;
  EXPECT_LT((placements->front().center_in_camera[0] - first).norm(), 0.001);  // mm; single precision
  EXPECT_LT((placements->front().center_in_camera[1] - second).norm(), 0.001);
  text.replace(text.find("128, 20, 652"), 12, "300, 20, 652");
  const auto lost = MeasurePlacements(*ParsePlacements(text, "bar.toml", folder));
  ASSERT_FALSE(lost.ok());
  EXPECT_THAT(lost.error().message, HasSubstr("low.ply: placement low, ball 2: "));
  fs::remove_all(folder);
}

// Whoever has only the points cannot tell which calibration made them.
TEST(PlacementsFile, CloudsNeedTheirCalibrationsCrc) {
  EXPECT_FALSE(ParsePlacements(kGood, "bar.toml", "")->calibration_crc32);
  const std::string with_crc = fmt::format("calibration_crc32 = 4294967295\n{}", kGood);
  EXPECT_EQ(ParsePlacements(with_crc, "bar.toml", "")->calibration_crc32, 0xffffffff);
  EXPECT_THAT(Refusal(with_crc, "4294967295", "4294967296"), HasSubstr("bar.toml: calibration_crc32"));
  EXPECT_THAT(Refusal(with_crc, "4294967295", "-1"), HasSubstr("bar.toml: calibration_crc32"));
  EXPECT_THAT(Refusal(kGood, "center_1_mm = [10, 20, 650]\ncenter_2_mm",
                      "cloud = \"low.ply\"\nnear_1_mm = [10, 20, 650]\nnear_2_mm"),
              HasSubstr("bar.toml: calibration_crc32 is missing"));
}

TEST(PlacementsFile, EveryWrongEntryIsNamed) {
  EXPECT_THAT(Refusal(kGood, "distance_mm = 125.0123", ""), HasSubstr("bar.toml: distance_mm is missing"));
  EXPECT_THAT(Refusal(kGood, "= 125.0123", "= nan"), HasSubstr("distance_mm"));
  EXPECT_THAT(Refusal(kGood, "= 0.001", "= -0.001"), HasSubstr("expanded_uncertainty_mm"));
  EXPECT_THAT(Refusal(kGood, "[240, 240, 160]", "[240, 240]"), HasSubstr("volume_mm"));
  EXPECT_THAT(Refusal(kGood, "center_2_mm", "centre_2_mm"), HasSubstr("center_2_mm"));
  EXPECT_THAT(Refusal(kGood, "focal_px", "focus_px"), HasSubstr("prior.focus_px"));
  EXPECT_THAT(Refusal(kGood, "name = \"low\"", "name = \"\""), HasSubstr("name"));
}

}  // namespace
}  // namespace forgescan
