#include "tools/forgescan/station/run_outcome.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <fstream>

namespace forgescan {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;

class RunOutcome : public ::testing::Test {
 protected:
  void TearDown() override { fs::remove_all(run_); }
  fsmsg::verdict_t Part(int part, int verdict, bool has_truth) const {
    fsmsg::verdict_t message{};
    message.part = part;
    message.verdict = static_cast<std::int8_t>(verdict);
    message.reason = "its reason";
    message.report_folder = std::to_string(part);
    fs::create_directories(run_ / "truth");
    fs::create_directories(results_ / message.report_folder);
    std::ofstream(results_ / message.report_folder / "report.html") << "html";
    std::ofstream(results_ / message.report_folder / "report.json") << "{}";
    if (has_truth) {
      std::ofstream(run_ / "truth" / fmt::format("part_{:06}.json", part)) << "{}";
    }
    return message;
  }
  std::string Show(const std::vector<fsmsg::verdict_t>& verdicts) {
    testing::internal::CaptureStdout();
    const Status status = ShowOutcome(run_, results_, verdicts, static_cast<int>(verdicts.size()));
    printed_ = testing::internal::GetCapturedStdout();
    return status.ok() ? "" : status.error().message;
  }

  const fs::path run_ = fs::path(::testing::TempDir()) / ("run_outcome_" + std::to_string(getpid()));
  const fs::path results_ = run_ / "results";
  std::string printed_;
};

TEST_F(RunOutcome, StartsAndPutsTheTruthBesideTheReport) {
  EXPECT_EQ(Show({Part(1, fsmsg::verdict_t::VERDICT_OK, true)}), "");
  EXPECT_EQ(printed_, "report " + (results_ / "1").string() + "\n");
  EXPECT_TRUE(fs::exists(results_ / "1" / "truth.json"));
}

TEST_F(RunOutcome, AMissingTruthHidesNeitherTheReasonNorTheNextReport) {
  const std::string problem = Show(
      {Part(1, fsmsg::verdict_t::VERDICT_NOT_INSPECTED, false), Part(2, fsmsg::verdict_t::VERDICT_OK, true)});
  EXPECT_THAT(problem, HasSubstr("part 1 was not inspected: its reason"));
  EXPECT_THAT(problem, HasSubstr("part_000001.json cannot be copied"));
  EXPECT_THAT(printed_, HasSubstr("report " + (results_ / "1").string() + "\n"));
  EXPECT_THAT(printed_, HasSubstr("report " + (results_ / "2").string() + "\n"));
}

TEST_F(RunOutcome, APartWithoutAReportIsNamed) {
  const auto verdict = Part(1, fsmsg::verdict_t::VERDICT_OK, true);
  fs::remove(results_ / "1" / "report.html");
  EXPECT_THAT(Show({verdict}), HasSubstr("part 1 has no report"));
  EXPECT_EQ(printed_, "");
}

}  // namespace
}  // namespace forgescan
