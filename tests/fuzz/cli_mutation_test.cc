// forgescan as a user calls it, on damaged files: it ends by itself with 0 or 1, says why if with 1, and then
// leaves no result behind.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <opencv2/imgcodecs.hpp>
#include <set>

#include "services/common/geometry/cloud_io.h"
#include "services/common/imaging/stereo_calibration_text.h"
#include "services/common/model/bundle_file.h"
#include "services/common/model/model_import.h"
#include "tests/common/calibration/bar_scene.h"
#include "tests/common/shapes/test_axle.h"
#include "tests/fuzz/mutate.h"
#include "tests/fuzz/readers.h"
#include "tests/fuzz/small_recording.h"
#include "tests/run_command.h"
#include "tests/services/reconstruction/fringe_scene.h"

namespace forgescan::fuzz {
namespace {

namespace fs = std::filesystem;

struct Case {
  std::string name;
  std::map<std::string, std::string> files;  // by name
  std::vector<std::string> damaged;          // of the files, one in each run
  std::string arguments;
  std::vector<std::string> outputs;
  int runs = 4;
  int exit_code = 0;        // with good files
  bool keeps_rest = false;  // of a damaged file what is good is written, whatever the exit code
};

std::string Bytes(const fs::path& path) { return ReadInputFile(path).value(); }

std::string Number(double value) { return fmt::format("{:.12g}", value); }

std::string PatternText(const PatternSet& pattern) {
  std::string text = fmt::format("projector_width_px = {}\nphase_origin_px = {}\nbackground = \"own\"\n",
                                 pattern.projector_width_px, Number(pattern.phase_origin_px));
  for (const FringeFrequency& frequency : pattern.frequencies) {
    std::vector<std::string> names, shifts;
    for (std::size_t i = 0; i < frequency.frame_index.size(); ++i) {
      names.push_back(fmt::format("\"{}.png\"", frequency.frame_index[i]));
      shifts.push_back(Number(frequency.shift_rad[i] * 180 / 3.14159265358979323846));
    }
    text += fmt::format("[[frequency]]\nperiod_px = {}\nframes = [{}]\nshifts_deg = [{}]\n",
                        Number(frequency.period_px), fmt::join(names, ", "), fmt::join(shifts, ", "));
  }
  return text;
}

Case Reconstruct(const char* ending) {
  const StereoCalibration rig = SmallRig();
  const PatternSet pattern = SmallPattern(Background::kOwn);
  const StereoFrames frames = Render(Plane({0.1, 0.05, -1}, -400), rig, pattern, {});
  Case result{.name = std::string("Reconstruct") + (ending + 1),
              .files = {},
              .damaged = {},
              .arguments =
                  "reconstruct --left left --right right --calibration stereo.yaml --pattern pattern.toml "
                  "--out out.ply --json out.json",
              .outputs = {"out.ply", "out.json"}};
  for (const auto& [side, images] : {std::pair("left", &frames.left), std::pair("right", &frames.right)}) {
    for (std::size_t i = 0; i < images->size(); ++i) {
      std::vector<unsigned char> bytes;
      cv::imencode(ending, (*images)[i], bytes);
      // The pattern names PNG files; the content decides.
      result.files[fmt::format("{}/{}.png", side, i)] = std::string(bytes.begin(), bytes.end());
    }
  }
  result.files["stereo.yaml"] = StereoCalibrationText(rig);
  result.files["pattern.toml"] = PatternText(pattern);
  result.damaged = {"left/0.png", "stereo.yaml", "right/3.png", "pattern.toml", "left/1.png"};
  return result;
}

std::string BallPly() {
  PointCloud cloud;
  for (int i = 0; i < 400; ++i) {
    const float z = static_cast<float>(i) / 200 - 1, angle = static_cast<float>(i), r = std::sqrt(1 - z * z);
    cloud.points.emplace_back(20 * r * std::cos(angle), 20 * r * std::sin(angle), 20 * z + 500);
  }
  const fs::path path = ScratchFolder() / "ball.ply";
  EXPECT_TRUE(WritePly(path, cloud).ok());
  return Bytes(path);
}

std::vector<Case> ModelCases() {
  const fs::path step = ScratchFolder() / "axle.step";
  EXPECT_TRUE(testing::WriteAxleStep({}, step).ok());
  const ModelBundle model = LoadModel(step, {8, {0.1, 0.3}}).value();
  const fs::path scan = ScratchFolder() / "scan.ply";
  EXPECT_TRUE(WritePly(scan, testing::ScanOf(model, {.points = 4000, .foreign_share = 0})).ok());
  const std::map<std::string, std::string> files = {{"scan.ply", Bytes(scan)},
                                                    {"axle.bundle", EncodeBundle(model)},
                                                    {"axle.step", Bytes(step)},
                                                    {"start.txt", "1 0 0 0.5\n0 1 0 0\n0 0 1 0\n0 0 0 1\n"}};
  return {
      {.name = "Register",
       .files = files,
       .damaged = {"scan.ply", "start.txt", "axle.bundle"},
       .arguments =
           "register --scan scan.ply --model axle.bundle --initial start.txt --out pose.txt --json p.json",
       .outputs = {"pose.txt", "p.json"}},
      {.name = "Fit",
       .files = {{"ball.ply", BallPly()}},
       .damaged = {"ball.ply"},
       .arguments = "fit sphere --cloud ball.ply --json fit.json",
       .outputs = {"fit.json"}},
      {.name = "ImportStep",
       .files = files,
       .damaged = {"axle.step"},
       .arguments = "model import axle.step --out out.bundle --spacing-mm 20 --chord-error-mm 1",
       .outputs = {"out.bundle"}},
      {.name = "ImportPly",
       .files =
           {{"m.ply",
             "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float "
             "z\nelement face 1\nproperty list uchar int vertex_index\nend_header\n0 0 0\n100 0 0\n0 100 "
             "0\n3 0 1 2\n"}},
       .damaged = {"m.ply"},
       .arguments = "model import m.ply --out out.bundle --spacing-mm 20",
       .outputs = {"out.bundle"}}};
}

Case RefineCase() {
  const StereoCalibration written = Corrected(TrueRig(), SomeError());
  return {.name = "Refine",
          .files = {{"stereo.yaml", StereoCalibrationText(written)},
                    {"bar.toml", PlacementsText(MeasuredBar(written, 125, 0.002), 125)}},
          .damaged = {"stereo.yaml", "bar.toml"},
          .arguments =
              "calibration refine --calibration stereo.yaml --placements bar.toml --out b.yaml --json b.json",
          .outputs = {"b.yaml", "b.json"}};
}

std::vector<Case> LogCases() {
  const std::map<std::string, std::string> files = {
      {"a.log", SmallRecording(ScratchFolder() / "written.lcmlog")}};
  const auto with = [&files](const std::string& name, const std::string& arguments,
                             const std::vector<std::string>& outputs) {
    return Case{
        .name = name, .files = files, .damaged = {"a.log"}, .arguments = arguments, .outputs = outputs};
  };
  std::vector<Case> cases = {with("LogInfo", "log info a.log", {}),
                             with("LogCheck", "log check a.log", {}),
                             with("LogRepair", "log repair a.log --out b.log", {"b.log"}),
                             with("LogCut", "log cut a.log --out b.log --part 7", {"b.log"}),
                             with("LogExport", "log export a.log --out b", {"b"}),
                             with("LogMcap", "log export a.log --mcap b.mcap", {"b.mcap"}),
                             with("Replay", "replay a.log --report b.html", {"b.html"})};
  for (Case& one : cases) one.keeps_rest = one.name == "LogExport" || one.name == "LogMcap";
  cases.back().exit_code = 1;  // of a station that has no reconstruction
  return cases;
}

const std::vector<Case>& Cases() {
  static const std::vector<Case> cases = [] {
    std::vector<Case> all = {Reconstruct(".png"), Reconstruct(".pgm"), Reconstruct(".tiff"), RefineCase()};
    for (const auto& group : {ModelCases(), LogCases()}) all.insert(all.end(), group.begin(), group.end());
    return all;
  }();
  return cases;
}

class DamagedFile : public ::testing::TestWithParam<std::string> {
 protected:
  void SetUp() override {
    folder_ = ScratchFolder() / GetParam();
    for (const char* folder : {"left", "right", "tmp"}) fs::create_directories(folder_ / folder);
    const auto& cases = Cases();
    case_ = *std::find_if(cases.begin(), cases.end(), [](const Case& c) { return c.name == GetParam(); });
    for (const auto& [name, bytes] : case_.files) Write(name, bytes);
  }
  void TearDown() override { fs::remove_all(folder_); }

  void Write(const std::string& name, const std::string& bytes) const {
    std::ofstream(folder_ / name, std::ios::binary | std::ios::trunc) << bytes;
  }
  CommandOutput Call() const {
    for (const std::string& output : case_.outputs) fs::remove_all(folder_ / output);
    return RunCommand("cd " + folder_.string() + " && TMPDIR=" + (folder_ / "tmp").string() + " timeout 60 " +
                      FORGESCAN_BIN_DIR + "/forgescan " + case_.arguments);
  }
  // What the command has left that it should not have, or nothing.
  std::string Leftover(int exit_code) const {
    for (const std::string& output : case_.outputs) {
      if (fs::exists(folder_ / output) != (exit_code == 0) && !case_.keeps_rest) return output;
    }
    for (const auto& entry : fs::recursive_directory_iterator(folder_)) {
      const std::string name = fs::relative(entry.path(), folder_).string();
      const bool known = case_.files.contains(name) || name == "left" || name == "right" || name == "tmp";
      const auto& outputs = case_.outputs;
      const auto is_of = [&name](const std::string& output) {
        return name == output || name.starts_with(output + "/");
      };
      if (!known && std::none_of(outputs.begin(), outputs.end(), is_of)) return name;
    }
    return {};
  }

  fs::path folder_;
  Case case_;
};

TEST_P(DamagedFile, IsReadOrRefused) {
  EXPECT_EQ(Call().exit_code, case_.exit_code) << Call().text;
  for (int run = 0; run < case_.runs; ++run) {
    const std::string& name = case_.damaged[static_cast<std::size_t>(run) % case_.damaged.size()];
    std::mt19937_64 random(static_cast<std::uint64_t>(run));
    Write(name, Mutate(case_.files.at(name), random));
    const CommandOutput output = Call();
    ASSERT_TRUE(output.exit_code == 0 || output.exit_code == 1)
        << name << ", run " << run << ": exit code " << output.exit_code << "\n"
        << output.text.substr(0, 4000);
    EXPECT_NE(output.exit_code == 1 ? output.text : "a result", "") << name << ", run " << run;
    ASSERT_EQ(Leftover(output.exit_code), "")
        << name << ", run " << run << ": exit code " << output.exit_code << "\n"
        << output.text.substr(0, 4000);
    Write(name, case_.files.at(name));
  }
  EXPECT_EQ(Call().exit_code, case_.exit_code);
}

INSTANTIATE_TEST_SUITE_P(Of, DamagedFile, ::testing::ValuesIn([] {
                           std::vector<std::string> names;
                           for (const Case& one : Cases()) names.push_back(one.name);
                           return names;
                         }()),
                         [](const auto& one) { return one.param; });

}  // namespace
}  // namespace forgescan::fuzz
