// The page the experiments write, and its pictures.
#include "tools/forgescan/experiment/experiment_page.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>
#include <filesystem>
#include <fstream>

#include "services/common/input_file.h"
#include "tests/run_command.h"
#include "tools/forgescan/experiment/chart.h"

namespace forgescan {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;
using ::testing::Not;

class ExperimentPage : public ::testing::Test {
 protected:
  void SetUp() override { fs::create_directories(folder_); }
  void TearDown() override { fs::remove_all(folder_); }

  std::string Read(const std::string& name) const {
    const auto text = ReadInputFile(folder_ / name);
    return text.ok() ? *text : std::string();
  }
  void Write(const std::string& name, const std::string& text) const {
    fs::create_directories((folder_ / name).parent_path());
    std::ofstream(folder_ / name) << text;
  }
  std::string Svg(const std::string& name) const { return SvgFile(name, 900, 10, ""); }

  fs::path folder_ = fs::path(::testing::TempDir()) / ("forgescan_page_" + std::to_string(getpid()));
};

TEST_F(ExperimentPage, Starts) { EXPECT_GE(Experiments().size(), 8u); }

TEST_F(ExperimentPage, SectionsStandInOneOrderWhateverWasRunFirst) {
  for (const char* name : {"fig15", "noise", "clutter"}) {
    ASSERT_TRUE(WriteExperiment(folder_, name, std::string("of ") + name + "\n", Svg(name)).ok());
  }
  const std::string one = Read("experiments.md");
  EXPECT_LT(one.find("of noise"), one.find("of clutter"));
  EXPECT_LT(one.find("of clutter"), one.find("of fig15"));
  EXPECT_TRUE(one.starts_with("<!-- page of: forgescan experiment -->\n# Experiments\n"));
  fs::remove(folder_ / "experiments.md");
  for (const char* name : {"noise", "clutter", "fig15"}) {
    ASSERT_TRUE(WriteExperiment(folder_, name, std::string("of ") + name + "\n", Svg(name)).ok());
  }
  EXPECT_EQ(Read("experiments.md"), one);
}

TEST_F(ExperimentPage, ARunReplacesItsOwnSectionAndPictureOnly) {
  ASSERT_TRUE(WriteExperiment(folder_, "noise", "first\n", Svg("noise")).ok());
  ASSERT_TRUE(WriteExperiment(folder_, "gamma", "other\n", Svg("gamma")).ok());
  const std::string gamma = Read("experiments/gamma.svg");
  ASSERT_TRUE(WriteExperiment(folder_, "noise", "second\n", Svg("noise")).ok());
  const std::string page = Read("experiments.md");
  EXPECT_THAT(page, Not(HasSubstr("first")));
  EXPECT_THAT(page, HasSubstr("<!-- begin: noise -->\nsecond\n<!-- end: noise -->\n"));
  EXPECT_THAT(page, HasSubstr("<!-- begin: gamma -->\nother\n<!-- end: gamma -->\n"));
  EXPECT_EQ(Read("experiments/gamma.svg"), gamma);
}

TEST_F(ExperimentPage, RefusesWhatIsNotItsOwn) {
  Write("experiments.md", "# Notes of mine\n");
  EXPECT_EQ(CheckPlace(folder_, "noise").error().code, ErrorCode::kInvalidArgument);
  EXPECT_FALSE(WriteExperiment(folder_, "noise", "text\n", Svg("noise")).ok());
  EXPECT_EQ(Read("experiments.md"), "# Notes of mine\n");
  EXPECT_FALSE(fs::exists(folder_ / "experiments"));
  fs::remove(folder_ / "experiments.md");
  Write("experiments/noise.svg", "<svg>a drawing</svg>");
  EXPECT_EQ(CheckPlace(folder_, "noise").error().code, ErrorCode::kInvalidArgument);
  EXPECT_EQ(CheckPlace(folder_ / "nowhere", "noise").error().code, ErrorCode::kNotFound);
  EXPECT_TRUE(WriteExperiment(folder_, "gamma", "text\n", Svg("gamma")).ok());  // works after the errors
}

TEST_F(ExperimentPage, RefusesMarksThatDoNotPair) {
  ASSERT_TRUE(WriteExperiment(folder_, "noise", "text\n", Svg("noise")).ok());
  std::string page = Read("experiments.md");
  page.erase(page.find("<!-- end: noise -->"));
  Write("experiments.md", page);
  EXPECT_EQ(CheckPlace(folder_, "noise").error().code, ErrorCode::kInvalidArgument);
  EXPECT_EQ(CheckPlace(folder_, "gamma").error().code, ErrorCode::kInvalidArgument);
}

TEST_F(ExperimentPage, SectionSaysHowItIsMadeAndWhatWasMissed) {
  const Experiment& noise = Experiments().front();
  ExperimentReport report;
  report.question = "Why?";
  report.tables = {{{"a", "b"}, {{"1", "2"}}}};
  report.goals = {{"small", 1, 2, "mm"}, {"large", 1, 2, "mm", true}, {"no number", std::nan(""), 2, "mm"}};
  ExperimentOptions options;
  options.runs = 7;
  const std::string text = SectionText(noise, options, report);
  EXPECT_THAT(text, HasSubstr("    forgescan experiment noise --seed 1 --runs 7\n"));
  EXPECT_THAT(text, HasSubstr("| a | b |\n| --- | --- |\n| 1 | 2 |\n"));
  EXPECT_THAT(text, HasSubstr("| small | <= 2 | 1 | mm | met |"));
  EXPECT_THAT(text, HasSubstr("| large | >= 2 | 1 | mm | MISSED |"));
  EXPECT_THAT(text, HasSubstr("| no number | <= 2 | nan | mm | MISSED |"));
  EXPECT_THAT(text, HasSubstr("](experiments/noise.svg)"));
}

TEST_F(ExperimentPage, ChartsHoldWhatIsOutsideAndWhatIsNoNumber) {
  Chart chart{"a < b & c", {"x"}, {"y", true, 0.1, 10.0}, {}, {{1, "goal"}}};
  chart.series = {{"s", Mark::kLineDots, {0, 1, 2, 3}, {1e-9, std::nan(""), 1e9, 1}, 0}};
  const std::string svg = DrawChart(chart, {0, 0, 900, 400});
  EXPECT_THAT(svg, HasSubstr("a &lt; b &amp; c"));
  EXPECT_THAT(svg, Not(HasSubstr("nan")));
  EXPECT_THAT(svg, Not(HasSubstr("inf")));
  EXPECT_THAT(DrawChart({}, {}), Not(HasSubstr("nan")));  // no series at all
}

TEST_F(ExperimentPage, TheCommandWritesAndRefuses) {
  const auto call = [&](const std::string& arguments) {
    return RunCommand(std::string("cd ") + FORGESCAN_SOURCE_DIR + " && " + FORGESCAN_BIN_DIR +
                      "/forgescan experiment " + arguments);
  };
  const CommandOutput once = call("gamma --runs 1 --out " + folder_.string());
  EXPECT_EQ(once.exit_code, 0) << once.text;
  EXPECT_THAT(once.text, HasSubstr("reduced, linearised"));
  const std::string page = Read("experiments.md"), svg = Read("experiments/gamma.svg");
  EXPECT_THAT(page, HasSubstr("forgescan experiment gamma --seed 1 --runs 1"));
  EXPECT_EQ(call("gamma --runs 1 --out " + folder_.string()).exit_code, 0);
  EXPECT_EQ(Read("experiments.md"), page);
  EXPECT_EQ(Read("experiments/gamma.svg"), svg);
  EXPECT_NE(call("nothing --out " + folder_.string()).exit_code, 0);
  EXPECT_NE(call("noise --out " + (folder_ / "nowhere").string()).exit_code, 0);
  EXPECT_NE(call("noise --runs nan --out " + folder_.string()).exit_code, 0);
}

}  // namespace
}  // namespace forgescan
