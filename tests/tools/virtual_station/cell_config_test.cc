#include "tools/virtual_station/cell_config.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <sstream>

namespace forgescan {
namespace {

using testing::HasSubstr;

const std::string kCell = std::string(FORGESCAN_SOURCE_DIR) + "/stations/virtual/cell.toml";

// The station's file with one piece of text exchanged.
Result<CellConfig> LoadChanged(const std::string& from, const std::string& to) {
  std::stringstream stream;
  stream << std::ifstream(kCell).rdbuf();
  std::string text = stream.str();
  const std::size_t at = text.find(from);
  if (at == std::string::npos) {
    return Fail(ErrorCode::kNotFound, "the test looks for {}", from);
  }
  text.replace(at, from.size(), to);
  const std::string path = testing::TempDir() + "/cell_config_test.toml";
  std::ofstream(path) << text;
  auto config = LoadCellConfig(path);
  std::filesystem::remove(path);
  return config;
}

TEST(CellConfig, Starts) {
  const auto config = LoadCellConfig(kCell);
  ASSERT_TRUE(config.ok()) << config.error().message;
  EXPECT_EQ(config->views.size(), 10u);
  EXPECT_EQ(config->rig.left.width_px, 2448);
}

TEST(CellConfig, SmallerImagesSeeTheSameField) {
  const auto full = LoadCellConfig(kCell, 1);
  const auto quarter = LoadCellConfig(kCell, 4);
  ASSERT_TRUE(full.ok() && quarter.ok());
  EXPECT_EQ(quarter->rig.right.height_px, 512);
  const Eigen::Vector2d corner_full = Unproject(full->rig.left.lens, {-0.5, -0.5});
  const Eigen::Vector2d corner_quarter = Unproject(quarter->rig.left.lens, {-0.5, -0.5});
  EXPECT_LT((corner_full - corner_quarter).norm(), 1e-10);  // slope: rounding
}

TEST(CellConfig, EverySizeIsOneThatVirtualCamerasHave) {
  for (const int divisor : {1, 2, 4, 8}) {
    const auto config = LoadCellConfig(kCell, divisor);
    ASSERT_TRUE(config.ok()) << config.error().message;
    EXPECT_EQ(config->rig.left.width_px % 4, 0) << divisor;
    EXPECT_EQ(config->rig.left.height_px % 4, 0) << divisor;
    EXPECT_EQ(config->rig.left.width_px / 4, 2448 / divisor / 4) << divisor;
  }
}

TEST(CellConfig, OddPartsAreOptionalAndOfTheAxle) {
  const auto none =
      LoadChanged("[[odd_part]]\npart = 6\ndimension = \"total_length\"\nsize_mm = 1886.6\n", "");
  ASSERT_TRUE(none.ok()) << none.error().message;
  const auto all = LoadCellConfig(kCell);
  ASSERT_TRUE(all.ok());
  EXPECT_EQ(all->part.odd_parts.size(), none->part.odd_parts.size() + 1);
  const auto unknown = LoadChanged("dimension = \"total_length\"", "dimension = \"weight\"");
  ASSERT_FALSE(unknown.ok());
  EXPECT_THAT(unknown.error().message, HasSubstr("[[odd_part]] 0: dimension 'weight' is none of the axle"));
  const auto no_text = LoadChanged("dimension = \"total_length\"", "dimension = 1");
  ASSERT_FALSE(no_text.ok());
  EXPECT_THAT(no_text.error().message, HasSubstr("dimension must be a text"));
  const auto too_long = LoadChanged("size_mm = 1886.6", "size_mm = 3000.0");
  ASSERT_FALSE(too_long.ok());
  EXPECT_THAT(too_long.error().message, HasSubstr("total_length is 3000 mm, allowed"));
}

TEST(CellConfig, PostsStandOnTheirFeet) {
  const auto config = LoadCellConfig(kCell);
  ASSERT_TRUE(config.ok()) << config.error().message;
  EXPECT_GE(config->posts.size(), 12u);
  const auto sunk = LoadChanged("foot_z_mm = -250.0", "foot_z_mm = -20.0");
  ASSERT_FALSE(sunk.ok());
  EXPECT_THAT(sunk.error().message, HasSubstr("[[post]] 0: foot_z_mm must be below the z of top_mm"));
}

TEST(CellConfig, NamesFileKeyAndLimits) {
  const auto out_of_range = LoadChanged("baseline_mm = 250.0", "baseline_mm = 2.0");
  ASSERT_FALSE(out_of_range.ok());
  EXPECT_THAT(out_of_range.error().message,
              HasSubstr("cell_config_test.toml [rig]: baseline_mm is 2, allowed 50 to 1000"));
  const auto missing = LoadChanged("read_noise_dn = 0.35", "");
  ASSERT_FALSE(missing.ok());
  EXPECT_THAT(missing.error().message, HasSubstr("[sensor]: read_noise_dn is missing"));
  const auto unknown = LoadChanged("read_noise_dn = 0.35", "read_noise_dn = 0.35\nred_noise_dn = 1.0");
  ASSERT_FALSE(unknown.ok());
  EXPECT_THAT(unknown.error().message, HasSubstr("red_noise_dn is not a key"));
  const auto no_number = LoadChanged("read_noise_dn = 0.35", "read_noise_dn = \"low\"");
  ASSERT_FALSE(no_number.ok());
  EXPECT_THAT(no_number.error().message, HasSubstr("read_noise_dn must be a number, 0 to 20"));
  const auto not_a_number = LoadChanged("read_noise_dn = 0.35", "read_noise_dn = nan");
  EXPECT_FALSE(not_a_number.ok());
  const auto no_section = LoadChanged("[robot]", "[robots]");
  ASSERT_FALSE(no_section.ok());
  EXPECT_THAT(no_section.error().message, HasSubstr("robots is not a section"));
  const auto broken = LoadChanged("[rig]", "[rig");
  ASSERT_FALSE(broken.ok());
  EXPECT_THAT(broken.error().message, HasSubstr("line "));
  EXPECT_FALSE(LoadCellConfig("/nowhere/cell.toml").ok());
}

}  // namespace
}  // namespace forgescan
