// forgescan register and model import: what they find, and what they refuse.
#include <cmath>
#include <random>

#include "tests/tools/forgescan/cli.h"

namespace forgescan {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::json;

// A block of 200 x 120 x 60 mm about the origin; no two of its sides are equal.
const Eigen::Vector3d kHalfBlock(100, 60, 30);

std::string BlockStl() {
  std::string text = "solid block\n";
  const int kCorners[12][3] = {{0, 2, 1}, {1, 2, 3}, {4, 5, 6}, {5, 7, 6}, {0, 1, 4}, {1, 5, 4},
                               {2, 6, 3}, {3, 6, 7}, {0, 4, 2}, {2, 4, 6}, {1, 3, 5}, {3, 7, 5}};
  for (const auto& corners : kCorners) {
    text += "facet normal 0 0 0\nouter loop\n";
    for (const int i : corners) {
      const Eigen::Vector3d p = kHalfBlock.cwiseProduct(
          Eigen::Vector3d((i & 1) != 0 ? 1 : -1, (i & 2) != 0 ? 1 : -1, (i & 4) != 0 ? 1 : -1));
      text += fmt::format("vertex {} {} {}\n", p.x(), p.y(), p.z());
    }
    text += "endloop\nendfacet\n";
  }
  return text + "endsolid block\n";
}

// Points all over the block with 0.02 mm of noise, moved by `shift_mm`.
std::vector<Eigen::Vector3f> BlockScan(const Eigen::Vector3d& shift_mm) {
  std::mt19937 random(2);
  std::uniform_real_distribution<double> place(-1.0, 1.0);
  std::normal_distribution<double> noise(0.0, 0.02);
  std::vector<Eigen::Vector3f> points;
  for (int i = 0; i < 12'000; ++i) {
    Eigen::Vector3d p = kHalfBlock.cwiseProduct(Eigen::Vector3d(place(random), place(random), place(random)));
    const int axis = i % 3;
    p[axis] = (i % 6 < 3 ? 1 : -1) * (kHalfBlock[axis] + noise(random));
    points.emplace_back((p + shift_mm).cast<float>());
  }
  return points;
}

TEST_F(Cli, RegistersAPart) {
  std::ofstream(folder_ / "block.stl") << BlockStl();
  WriteCloud("scan.ply", BlockScan({1.5, -0.8, 0.6}));
  const std::string call = "register --scan scan.ply --model block.stl --spacing-mm 2 ";
  const CommandOutput output = Call(call + "--out pose.txt --json r.json --threads 0");
  ASSERT_EQ(output.exit_code, 0) << output.text;
  const Json result = ReadJson("r.json");
  const Eigen::Vector3d expected(-1.5, 0.8, -0.6);
  std::ifstream pose(folder_ / "pose.txt");
  for (std::size_t row = 0; row < 3; ++row) {
    for (std::size_t column = 0; column < 4; ++column) {
      double number = 0;
      ASSERT_TRUE(pose >> number);
      EXPECT_NEAR(number, result["model_from_scan"][row][column].get<double>(), 1e-9);
    }
    // mm: 0.02 / sqrt(2000 points a side) = 0.0005, ten of it.
    EXPECT_NEAR(result["model_from_scan"][row][3].get<double>(), expected[static_cast<Eigen::Index>(row)],
                0.005);
  }
  EXPECT_EQ(result["not_finite"].get<int>(), 0);
  EXPECT_EQ(result["points"].get<int>(), 12'000);
  ASSERT_EQ(Call(call + "--out pose2.txt --json r2.json --threads 2").exit_code, 0);
  EXPECT_EQ(ReadJson("r2.json"), result);  // for any number of threads
}

// The block maps onto itself by half turns: any of these poses is right, and none a rival of the other.
TEST_F(Cli, RegisterFindsAPartWithoutAStart) {
  std::ofstream(folder_ / "block.stl") << BlockStl();
  WriteCloud("far.ply", BlockScan({4000, -700, 90}));
  const std::string call =
      "register --search --scan far.ply --model block.stl --spacing-mm 2 --out pose.txt ";
  const CommandOutput output = Call(call + "--json r.json");
  ASSERT_EQ(output.exit_code, 0) << output.text;
  const Json result = ReadJson("r.json");
  EXPECT_LT(result["capped_score_mm"].get<double>(), 0.02);  // the noise's mean is 0.016 mm
  EXPECT_TRUE(result["rival_ratio"].is_null());
  std::ofstream(folder_ / "start.txt") << "1 0 0 0 0 1 0 0 0 0 1 0 0 0 0 1";
  EXPECT_NE(Call(call + "--initial start.txt").exit_code, 0);  // either a start or none
}

TEST_F(Cli, RegisterRefusesWhatItCannotTrust) {
  std::ofstream(folder_ / "block.stl") << BlockStl();
  WriteCloud("far.ply", BlockScan({4000, 0, 0}));
  const std::string outputs = " --model block.stl --spacing-mm 2 --out out.txt --json out.json";
  ExpectRefusal("register --scan far.ply" + outputs, "0 of 12000 scan points lie within");
  WriteCloud("scan.ply", BlockScan({0, 0, 0}));
  std::ofstream(folder_ / "pose.txt") << "1 0 0 0 0 1 0 0 0 0 1 0";
  ExpectRefusal("register --scan scan.ply --initial pose.txt" + outputs, "number 13 of the 16");
  ExpectRefusal("register --scan scan.ply --model block.stl --out out.txt --json out.txt",
                "two outputs would be written");
  ExpectRefusal("register --scan scan.ply --model block.stl --out scan.ply", "is both input and output");
  ExpectRefusal("register --scan scan.ply --model block.stl --out nowhere/out.txt",
                "its folder does not exist");
  EXPECT_TRUE(fs::exists(folder_ / "scan.ply"));
}

TEST_F(Cli, ImportsAModelButNotOverItself) {
  std::ofstream(folder_ / "block.stl") << BlockStl();
  const CommandOutput output = Call("model import block.stl --spacing-mm 4");
  ASSERT_EQ(output.exit_code, 0) << output.text;
  EXPECT_NE(output.text.find("12 triangles"), std::string::npos) << output.text;
  ExpectRefusal("model import block.bundle", "is both input and output");
  EXPECT_TRUE(fs::exists(folder_ / "block.bundle"));
}

}  // namespace
}  // namespace forgescan
