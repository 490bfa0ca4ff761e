// The offline commands as a user or a script calls them: exit code, one sentence, files only for trustworthy
// results.
#include "tests/tools/forgescan/cli.h"

#include <sys/stat.h>
#include <sys/sysmacros.h>

#include <cmath>
#include <random>

#include "services/common/service/station.h"
#include "tools/forgescan/station/station_services.h"

namespace forgescan {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::json;

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
  const CommandOutput output = Call("fit cylinder --cloud c.ply --json f.json");
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
  const CommandOutput output = Call("fit plane --cloud c.ply --near 20,50,7 --radius 15 --json f.json");
  ASSERT_EQ(output.exit_code, 0) << output.text;
  const Json fit = ReadJson("f.json");
  EXPECT_NEAR(std::abs(fit["normal"][2].get<double>()), 1.0, 1e-9);
  EXPECT_NEAR(std::abs(fit["offset_mm"].get<double>()), 7.0, 1e-6);
  EXPECT_LT(fit["points"].get<int>(), 1000);
}

TEST_F(Cli, FitRefusesWhatDoesNotDetermineTheShape) {
  std::vector<Eigen::Vector3f> line;
  for (int i = 0; i < 20; ++i) line.emplace_back(static_cast<float>(i), 0.F, 0.F);
  WriteCloud("line.ply", line);
  ExpectRefusal("fit plane --cloud line.ply --json out.json", "20 points lie on a line");
  ExpectRefusal("fit sphere --cloud line.ply --json out.json", "do not fix a sphere");
  ExpectRefusal("fit cylinder --cloud line.ply --json out.json", "no cylinder through the 20 points");
  line.resize(3);
  WriteCloud("three.ply", line);
  ExpectRefusal("fit plane --cloud three.ply --json out.json", "3 points, a plane needs at least 10");
  WriteCloud("c.ply", HalfCylinder());
  ExpectRefusal("fit plane --cloud c.ply --json out.json", "another shape");
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

TEST_F(Cli, FitRefusesWhatIsNoNeighbourhood) {
  WriteCloud("c.ply", HalfCylinder());
  const std::string fit = "fit cylinder --cloud c.ply --json out.json ";
  ExpectRefusal(fit + "--radius 5", "--near and --radius go together");
  ExpectRefusal(fit + "--near 1,2,3", "--near and --radius go together");
  ExpectRefusal(fit + "--near 1,2,3 --radius -5", "--radius is -5 mm");
  ExpectRefusal(fit + "--near 1,2,3 --radius nan", "--radius is nan mm");
  ExpectRefusal(fit + "--near 1,2,nan --radius 5", "three finite numbers");
  ExpectRefusal(fit + "--near 1,2,3 --near 4,5,6 --radius 5", "6 were given");
  ExpectRefusal(fit + "--reject-sigmas nan", "reject_sigmas of a fit is nan");
}

TEST_F(Cli, FitCountsPointsThatAreNotFinite) {
  std::vector<Eigen::Vector3f> points = HalfCylinder();
  points[3].x() = std::nanf("");
  WriteCloud("c.ply", points);
  ASSERT_EQ(Call("fit cylinder --cloud c.ply --json f.json").exit_code, 0);
  EXPECT_EQ(ReadJson("f.json")["not_finite"].get<int>(), 1);
}

// An output that cannot be written, or would destroy an input, stops the command before it begins.
TEST_F(Cli, OutputsAreCheckedBeforeTheWork) {
  WriteCloud("c.ply", HalfCylinder());
  const auto bytes = fs::file_size(folder_ / "c.ply");
  ExpectRefusal("fit cylinder --cloud c.ply --json c.ply", "is both input and output");
  ExpectRefusal("fit cylinder --cloud c.ply --json ./c.ply", "is both input and output");
  EXPECT_EQ(fs::file_size(folder_ / "c.ply"), bytes);
  ExpectRefusal("fit cylinder --cloud c.ply --json nowhere/out.json", "its folder does not exist");
  fs::create_directory(folder_ / "taken");
  ExpectRefusal("fit cylinder --cloud c.ply --json taken", "is a folder");
}

TEST_F(Cli, ARefusalLeavesNoOldResult) {
  std::ofstream(folder_ / "out.json") << "{}";
  std::ofstream(folder_ / "out.txt") << "1 0 0 0";
  ExpectRefusal("register --scan nothing.ply --model nothing.stl --out out.txt --json out.json",
                "nothing.stl");
  std::ofstream(folder_ / "out.bundle") << "old";
  ExpectRefusal("model import nothing.stl --out out.bundle", "nothing.stl");
}

TEST_F(Cli, ReconstructNamesWhatIsMissing) {
  ExpectRefusal(
      "reconstruct --left L --right R --calibration s.yaml --pattern p.toml --out out.ply --json out.json",
      "p.toml");
  std::ofstream(folder_ / "p.toml") << "projector_width_px = 1280\nbackground = \"own\"\n";
  std::ofstream(folder_ / "s.yaml") << "%YAML:1.0\n---\nrms: 0.1\n";
  ExpectRefusal("reconstruct --left L --right R --calibration s.yaml --pattern p.toml --out out.ply",
                "p.toml");
}

TEST_F(Cli, AnUnknownCommandIsAUsageError) {
  const CommandOutput output = Call("melt");
  EXPECT_NE(output.exit_code, 0);
  EXPECT_NE(output.text.find("melt is no command"), std::string::npos) << output.text;
  EXPECT_NE(Call("").text.find("subcommand is required"), std::string::npos);
}

TEST_F(Cli, NumbersOutsideTheirRangeAreUsageErrors) {
  WriteCloud("c.ply", HalfCylinder());
  for (const char* call :
       {"inspect --takt nan", "inspect --takt inf", "inspect --patience nan",
        "model import block.stl --chord-error-mm inf", "fit cylinder --cloud c.ply --min-points -1"}) {
    const CommandOutput output = Call(call);
    EXPECT_NE(output.exit_code, 0) << call;
    EXPECT_NE(output.text.find("is not a number from"), std::string::npos) << output.text;
  }
}

TEST_F(Cli, AResultThatStandardOutputCannotTakeIsAnError) {
  const fs::path full = folder_ / "full";
  if (mknod(full.c_str(), S_IFCHR | 0600, makedev(1, 7)) != 0 || !std::ofstream(full)) {
    GTEST_SKIP() << "needs the right to make a device node";
  }
  WriteCloud("c.ply", HalfCylinder());
  for (const char* call : {"fit cylinder --cloud c.ply", "--help"}) {
    EXPECT_EQ(Call(std::string(call) + " 2>error.txt >full").exit_code, 1) << call;
    std::ifstream error(folder_ / "error.txt");
    std::string sentence;
    std::getline(error, sentence);
    EXPECT_EQ(sentence, "forgescan: standard output cannot be written") << call;
  }
}

TEST(StationServices, AreThoseThatTheReportWaitsFor) {
  std::vector<std::string> started;
  for (const StationService& service : StationServices({})) {
    started.push_back(service.name);
  }
  EXPECT_EQ(started, std::vector<std::string>(kServiceNames.begin(), kServiceNames.end()));
}

}  // namespace
}  // namespace forgescan
