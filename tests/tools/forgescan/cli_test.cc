// The offline commands as a user or a script calls them: exit code, one sentence, files only for trustworthy
// results.
#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <random>

#include "services/common/geometry/cloud_io.h"

namespace forgescan {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::json;

struct Output {
  int exit_code = -1;
  std::string text;  // standard output and error
};

class Cli : public ::testing::Test {
 protected:
  void SetUp() override {
    folder_ = fs::path(::testing::TempDir()) / ("forgescan_cli_" + std::to_string(getpid()));
    fs::create_directories(folder_);
  }
  void TearDown() override { fs::remove_all(folder_); }

  Output Call(const std::string& arguments) const {
    Output output;
    const std::string command =
        "cd " + folder_.string() + " && " + FORGESCAN_BIN_DIR + "/forgescan " + arguments + " 2>&1";
    FILE* pipe = popen(command.c_str(), "r");
    std::array<char, 4096> buffer{};
    while (std::fgets(buffer.data(), buffer.size(), pipe) != nullptr) {
      output.text += buffer.data();
    }
    output.exit_code = WEXITSTATUS(pclose(pipe));
    return output;
  }
  // Fails with one sentence that contains `what`, and writes none of the files.
  void ExpectRefusal(const std::string& arguments, const std::string& what) const {
    const Output output = Call(arguments);
    EXPECT_NE(output.exit_code, 0) << arguments;
    EXPECT_NE(output.text.find(what), std::string::npos) << output.text;
    EXPECT_EQ(std::count(output.text.begin(), output.text.end(), '\n'), 1) << output.text;
    for (const char* file : {"out.ply", "out.json", "out.txt", "out.bundle"}) {
      EXPECT_FALSE(fs::exists(folder_ / file)) << arguments << " left " << file;
    }
  }
  void WriteCloud(const std::string& name, const std::vector<Eigen::Vector3f>& points) const {
    PointCloud cloud;
    cloud.points = points;
    ASSERT_TRUE(WritePly(folder_ / name, cloud).ok());
  }
  Json ReadJson(const std::string& name) const {
    std::ifstream stream(folder_ / name);
    return Json::parse(stream);
  }

  fs::path folder_;
};

// Points of a half cylinder about x, radius 44.75 mm, with 0.01 mm of noise.
std::vector<Eigen::Vector3f> HalfCylinder() {
  std::mt19937 random(1);
  std::normal_distribution<double> noise(44.75, 0.01);
  std::uniform_real_distribution<double> along(0.0, 120.0), around(0.0, M_PI);
  std::vector<Eigen::Vector3f> points;
  for (int i = 0; i < 20'000; ++i) {
    const double x = along(random), angle = around(random), radius = noise(random);
    points.emplace_back(Eigen::Vector3d(x, radius * std::cos(angle), radius * std::sin(angle)).cast<float>());
  }
  return points;
}

TEST_F(Cli, FitsACylinder) {
  WriteCloud("c.ply", HalfCylinder());
  const Output output = Call("fit cylinder --cloud c.ply --json f.json");
  ASSERT_EQ(output.exit_code, 0) << output.text;
  const Json fit = ReadJson("f.json");
  EXPECT_NEAR(fit["radius_mm"].get<double>(), 44.75,
              0.001);  // mm; 4.6 sigma / sqrt(n) = 0.0003 for a half cylinder
  EXPECT_NEAR(fit["sigma_mm"].get<double>(), 0.01, 0.001);
  EXPECT_NEAR(fit["arc_deg"].get<double>(), 180.0, 1.0);
  EXPECT_NEAR(std::abs(fit["axis"][0].get<double>()), 1.0, 1e-6);
  EXPECT_EQ(fit["points"].get<int>() + fit["rejected"].get<int>(), 20'000);
}

TEST_F(Cli, FitsAPlaneNearAPlace) {
  std::vector<Eigen::Vector3f> points;
  for (int i = 0; i < 10'000; ++i) {
    points.emplace_back(static_cast<float>(i % 100), static_cast<float>(i / 100), i % 100 < 50 ? 7.F : 300.F);
  }
  WriteCloud("c.ply", points);
  const Output output = Call("fit plane --cloud c.ply --near 20,50,7 --radius 15 --json f.json");
  ASSERT_EQ(output.exit_code, 0) << output.text;
  const Json fit = ReadJson("f.json");
  EXPECT_NEAR(std::abs(fit["normal"][2].get<double>()), 1.0, 1e-9);
  EXPECT_NEAR(std::abs(fit["offset_mm"].get<double>()), 7.0, 1e-6);
  EXPECT_LT(fit["points"].get<int>(), 1000);
}

TEST_F(Cli, FitRefusesWhatDoesNotDetermineTheShape) {
  WriteCloud("line.ply", {{0, 0, 0}, {1, 0, 0}, {2, 0, 0}, {3, 0, 0}, {4, 0, 0}, {5, 0, 0}, {6, 0, 0}});
  for (const char* shape : {"plane", "sphere", "cylinder"}) {
    ExpectRefusal(std::string("fit ") + shape + " --cloud line.ply --json out.json", "");
  }
  ExpectRefusal("fit plane --cloud nothing.ply --json out.json", "nothing.ply");
}

TEST_F(Cli, TruncatedAndForeignFilesAreRefused) {
  WriteCloud("c.ply", HalfCylinder());
  fs::resize_file(folder_ / "c.ply", 20'000);
  ExpectRefusal("fit cylinder --cloud c.ply --json out.json", "c.ply");
  std::ofstream(folder_ / "text.ply") << "this is not a cloud";
  ExpectRefusal("fit cylinder --cloud text.ply --json out.json", "text.ply");
  ExpectRefusal("register --scan text.ply --model text.ply --out out.txt --json out.json", "text.ply");
  std::ofstream(folder_ / "text.step") << "this is not a model";
  ExpectRefusal("model import text.step --out out.bundle", "text.step");
}

TEST_F(Cli, ReconstructNamesWhatIsMissing) {
  ExpectRefusal(
      "reconstruct --left L --right R --calibration s.yaml --pattern p.toml --out out.ply --json out.json",
      "");
  std::ofstream(folder_ / "p.toml") << "projector_width_px = 1280\nbackground = \"own\"\n";
  std::ofstream(folder_ / "s.yaml") << "%YAML:1.0\n---\nrms: 0.1\n";
  ExpectRefusal("reconstruct --left L --right R --calibration s.yaml --pattern p.toml --out out.ply", "");
}

TEST_F(Cli, AnUnknownCommandIsAUsageError) { EXPECT_NE(Call("melt").exit_code, 0); }

}  // namespace
}  // namespace forgescan
