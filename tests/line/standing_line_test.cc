// A line whose station corrects the robot's error by the posts of its cell: a part, and a scan of the empty
// cell.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <fstream>

#include "services/fusion/standing_file.h"
#include "tests/line/sim_line.h"
#include "tools/forgescan/replay/recorded_station.h"
#include "tools/forgescan/replay/replay_run.h"
#include "tools/forgescan/replay/scratch_folder.h"
#include "tools/forgescan/standing/empty_scans.h"

namespace forgescan {
namespace {

using ::testing::HasSubstr;
using ::testing::IsEmpty;
using testing::RenderedCell;
using testing::SimLine;
using testing::StandingPosts;

namespace fs = std::filesystem;

constexpr std::int64_t kSettleUs = 10'000'000;  // until the last part's file is closed
constexpr int kPart = 1, kEmptyCell = 2;
constexpr double kSizeToleranceMm = 0.15;  // as sim_line_test has it

class StandingLineTest : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    auto cell = RenderedCell::Create(StandingPosts::kUsed);
    ASSERT_TRUE(cell.ok()) << cell.error().message;
    cell_ = std::move(*cell);
    cell_->TakeAway(kEmptyCell);
    auto folder = ScratchFolder::Make();
    ASSERT_TRUE(folder.ok()) << folder.error().message;
    folder_ = std::make_unique<ScratchFolder>(std::move(*folder));
    auto line = SimLine::Create(*cell_, 2);
    ASSERT_TRUE(line.ok()) << line.error().message;
    line_ = std::move(*line);
    ASSERT_TRUE(line_->RunUntilSorted(2));
    line_->RunFor(kSettleUs);
    fs::rename(line_->StopRecording(), folder_->path() / "recordings");
  }
  static void TearDownTestSuite() {
    line_.reset();
    cell_.reset();
    folder_.reset();
  }
  static std::string Log(int part) {
    for (const auto& entry : fs::directory_iterator(folder_->path() / "recordings" / "parts")) {
      if (entry.path().string().find(fmt::format("part{:06}", part)) != std::string::npos) {
        return entry.path().string();
      }
    }
    return {};
  }
  static StandingOrigin Origin() {
    return {cell_->path_crc32(), Crc32OfFile((cell_->folder() / "calibration/stereo.yaml").string()).value()};
  }

  static std::unique_ptr<RenderedCell> cell_;
  static std::unique_ptr<SimLine> line_;
  static std::unique_ptr<ScratchFolder> folder_;
};
std::unique_ptr<RenderedCell> StandingLineTest::cell_;
std::unique_ptr<SimLine> StandingLineTest::line_;
std::unique_ptr<ScratchFolder> StandingLineTest::folder_;

TEST_F(StandingLineTest, APartIsInspectedWithItsViewsCorrected) {
  ASSERT_EQ(line_->verdicts().size(), 2U);
  const fsmsg::verdict_t& verdict = line_->verdicts().front();
  EXPECT_EQ(verdict.verdict, fsmsg::verdict_t::VERDICT_OK) << verdict.reason;
  const auto truth = cell_->TrueSizesMm(kPart);
  ASSERT_TRUE(truth.ok()) << truth.error().message;
  ASSERT_EQ(verdict.dimensions.size(), truth->size());
  for (const fsmsg::dimension_t& dimension : verdict.dimensions) {
    EXPECT_NEAR(dimension.measured_mm, truth->at(dimension.name), kSizeToleranceMm) << dimension.name;
  }
  // Of the part and of the empty cell, but for that one's last view: no view of it has a temperature, so it
  // is void before that cloud comes. The two views of the beam see one post each, which the part may hide.
  const std::int64_t corrected = line_->Total("views_corrected");
  EXPECT_EQ(corrected + line_->Total("views_uncorrected"), 2 * cell_->view_count() - 1);
  EXPECT_GE(corrected, 2 * (cell_->view_count() - 2) - 1);
  EXPECT_EQ(line_->Total("views_knocked"), 0);
  EXPECT_GT(line_->Total("last_view_cells"), 100);
}

TEST_F(StandingLineTest, TheRecordingHoldsTheFileAndReplaysToEqualBytes) {
  const auto session = RecordedSession::Open({Log(kPart)});
  ASSERT_TRUE(session.ok()) << session.error().message;
  EXPECT_THAT(session->findings(), IsEmpty());
  const auto scratch = ScratchFolder::Make();
  ASSERT_TRUE(scratch.ok());
  const auto station = UnpackStation(*session, {}, scratch->path());
  ASSERT_TRUE(station.ok()) << station.error().message;
  EXPECT_EQ(fs::path(station->standing).filename(), "standing.ply");
  ReplayOptions options;
  options.services = *SelectServices({"fusion"});
  const auto outcome = Replay(*session, *station, options);
  ASSERT_TRUE(outcome.ok()) << outcome.error().message;
  ASSERT_TRUE(outcome->comparison.channels().contains(kFusedCloud.name));
  for (const auto& [channel, counts] : outcome->comparison.channels()) {
    EXPECT_GT(counts.equal, 0) << channel;
    EXPECT_TRUE(counts.Same()) << channel;
  }
}

TEST_F(StandingLineTest, AnotherCalibrationAsksForAnotherFile) {
  const auto session = RecordedSession::Open({Log(kPart)});
  ASSERT_TRUE(session.ok()) << session.error().message;
  const auto scratch = ScratchFolder::Make();
  ASSERT_TRUE(scratch.ok());
  const fs::path other = folder_->path() / "other.yaml";
  fs::copy_file(cell_->folder() / "calibration/stereo.yaml", other);
  std::ofstream(other, std::ios::app) << "# calibrated again\n";
  const auto station = UnpackStation(
      *session, {.config = "", .values = {}, .files = {{"calibration", other}}}, scratch->path());
  ASSERT_TRUE(station.ok()) << station.error().message;
  ReplayOptions options;
  options.services = *SelectServices({"fusion"});
  const auto outcome = Replay(*session, *station, options);
  ASSERT_FALSE(outcome.ok());
  EXPECT_THAT(outcome.error().message,
              HasSubstr("standing.ply: its surfaces were seen with the calibration"));
}

// Without a part the scan has no temperatures and no verdict on sizes, but its points are in the recording.
TEST_F(StandingLineTest, AScanOfTheEmptyCellIsAReference) {
  EXPECT_EQ(line_->verdicts().back().verdict, fsmsg::verdict_t::VERDICT_NOT_INSPECTED);
  const auto scans = ReadEmptyScans({Log(kEmptyCell)}, Origin());
  ASSERT_TRUE(scans.ok()) << scans.error().message;
  ASSERT_EQ(scans->size(), 1U);
  EXPECT_EQ(scans->front().size(), static_cast<std::size_t>(cell_->view_count()));
  const auto matrices = ViewMatrices::Load((cell_->folder() / "views/views.toml").string());
  ASSERT_TRUE(matrices.ok()) << matrices.error().message;
  const Eigen::AlignedBox3d cell(Eigen::Vector3d::Constant(-2000), Eigen::Vector3d::Constant(2000));
  const auto standing = MakeStandingSurfaces(*scans, {Origin(), *matrices, {&cell, 1}, {}});
  ASSERT_TRUE(standing.ok()) << standing.error().message;
  for (const auto& view : standing->views) EXPECT_GT(view.size(), 100U);
}

TEST_F(StandingLineTest, OnlyScansOfTheEmptyCellAreTaken) {
  const auto hot = ReadEmptyScans({Log(kEmptyCell), Log(kPart)}, Origin());
  ASSERT_FALSE(hot.ok());
  EXPECT_EQ(hot.error().code, ErrorCode::kUntrusted);
  EXPECT_THAT(hot.error().message, HasSubstr("not a scan of the empty cell"));
  const auto other_path =
      ReadEmptyScans({Log(kEmptyCell)}, {Origin().path_crc32 + 1, Origin().calibration_crc32});
  EXPECT_THAT(other_path.error().message, HasSubstr("was scanned on the robot's path"));
  const auto other_calibration = ReadEmptyScans({Log(kEmptyCell)}, {Origin().path_crc32, 1});
  EXPECT_THAT(other_calibration.error().message, HasSubstr("the station has 00000001"));
  EXPECT_EQ(ReadEmptyScans({"/nowhere.lcmlog"}, Origin()).error().code, ErrorCode::kNotFound);
}

}  // namespace
}  // namespace forgescan
