// A session of the whole line, recorded and computed again.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <map>

#include "tests/line/sim_line.h"
#include "tools/forgescan/replay/message_text.h"
#include "tools/forgescan/replay/replay_run.h"
#include "tools/forgescan/replay/scratch_folder.h"
#include "tools/forgescan/replay/what_if.h"

namespace forgescan {
namespace {

namespace fs = std::filesystem;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Key;
using ::testing::Pair;
using testing::RenderedCell;
using testing::SimLine;
using ::testing::SizeIs;

constexpr int kParts = 3;
constexpr std::int64_t kNoticeUs = 80'000;      // from the death of a process to the start of the next
constexpr std::int64_t kSettleUs = 10'000'000;  // until the last part's file is closed

class ReplayLineTest : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    auto cell = RenderedCell::Create();
    ASSERT_TRUE(cell.ok()) << cell.error().message;
    cell_ = std::move(*cell);
    auto folder = ScratchFolder::Make();
    ASSERT_TRUE(folder.ok()) << folder.error().message;
    folder_ = std::make_unique<ScratchFolder>(std::move(*folder));
    Record("calm", {});
    Record("lossy",
           {.loss = 0.03, .large_loss = 0.3, .duplicate = 0.05, .latency_us = 200, .jitter_us = 3000});
    RecordKills();
  }
  static void TearDownTestSuite() {
    cell_.reset();
    folder_.reset();
  }

  // The line inspects parts while a recorder listens to `name`.
  static void Record(const std::string& name, const SimFaults& faults) {
    auto line = SimLine::Create(*cell_, kParts);
    ASSERT_TRUE(line.ok()) << line.error().message;
    (*line)->SetBusFaults(faults);
    ASSERT_TRUE((*line)->RunUntilSorted(kParts));
    (*line)->RunFor(kSettleUs);
    fs::rename((*line)->StopRecording(), folder_->path() / name);
    EXPECT_EQ((*line)->StreamTotals().missing, 0);
    EXPECT_TRUE(faults.loss == 0.0 || (*line)->StreamTotals().recovered > 0);
  }
  // Each service is killed once, and started again as soon as a supervisor notices it.
  static void RecordKills() {
    auto line = SimLine::Create(*cell_, kParts + 1);
    ASSERT_TRUE(line.ok()) << line.error().message;
    const auto strike = [&line](const std::string& service) {
      (*line)->Kill(service);
      (*line)->RunFor(kNoticeUs);
      const Status started = (*line)->StartAgain(service);
      ASSERT_TRUE(started.ok()) << started.error().message;
    };
    const int view = 2 * 8, part = cell_->view_count() * view;  // images: two cameras, 8 patterns
    ASSERT_TRUE((*line)->RunUntilExposed(view + 4));
    strike("reconstruction");  // so that part 1 lacks a view
    ASSERT_TRUE((*line)->RunUntilExposed(2 * part));
    ASSERT_TRUE((*line)->RunUntilPublished(kFusionResult.name));
    strike("report");  // of part 2 it has taken results in, and is sent the others while nobody listens
    ASSERT_TRUE((*line)->RunUntilExposed(2 * part + 2 * view));
    strike("fusion");  // which forgets the views of part 3 it has
    strike("registration");
    ASSERT_TRUE((*line)->RunUntilSorted(kParts + 1));
    (*line)->RunFor(kSettleUs);
    std::map<int, std::string> reasons;  // of parts that were not inspected
    for (const auto& verdict : (*line)->verdicts()) {
      if (verdict.verdict == fsmsg::verdict_t::VERDICT_NOT_INSPECTED) {
        reasons[verdict.part] = verdict.reason;
      }
    }
    EXPECT_THAT(reasons, ElementsAre(Key(1), Pair(2, HasSubstr("started again")), Key(3)));
    fs::rename((*line)->StopRecording(), folder_->path() / "killed");
  }
  static std::vector<std::string> Logs(const std::string& name) {
    std::vector<std::string> logs;
    for (const auto& entry : fs::directory_iterator(folder_->path() / name / "parts")) {
      logs.push_back(entry.path().string());
    }
    std::sort(logs.begin(), logs.end());
    return logs;
  }
  static RecordedSession Open(const std::vector<std::string>& logs) {
    auto session = RecordedSession::Open(logs);
    EXPECT_TRUE(session.ok()) << session.error().message;
    return std::move(*session);
  }

  // Every service on the recorded inputs of the others, or all in a chain, with the changes.
  static ReplayOutcome Compute(const RecordedSession& session, bool chained, const StationChanges& changes,
                               std::vector<fsmsg::verdict_t>* verdicts = nullptr) {
    auto scratch = ScratchFolder::Make();
    EXPECT_TRUE(scratch.ok());
    const auto station = UnpackStation(session, changes, scratch->path());
    EXPECT_TRUE(station.ok()) << station.error().message;
    ReplayOptions options;
    options.services = *SelectServices({});
    options.chained = chained;
    options.on_result = [verdicts](const std::string& channel, ByteView message) {
      if (verdicts != nullptr && channel == kVerdict.name) {
        verdicts->push_back(*Decode<fsmsg::verdict_t>(message));
      }
    };
    auto outcome = Replay(session, *station, options);
    EXPECT_TRUE(outcome.ok()) << outcome.error().message;
    return std::move(*outcome);
  }
  static void ExpectSame(const ReplayOutcome& outcome, const RecordedSession& session) {
    EXPECT_THAT(outcome.changed_inputs, IsEmpty());
    for (const auto& [channel, counts] : outcome.comparison.channels()) {
      EXPECT_GT(counts.equal, 0) << channel;
      EXPECT_TRUE(counts.Same()) << channel << ": " << counts.differing << " differ, " << counts.missing
                                 << " missing, " << counts.extra << " extra";
    }
    if (const auto& first = outcome.comparison.first_difference(); first.has_value()) {
      for (const auto& line : FieldDifferences(session.types(), first->recorded, first->replayed, 9)) {
        ADD_FAILURE() << first->channel << " " << first->where << ": " << line;
      }
    }
  }

  static std::unique_ptr<RenderedCell> cell_;
  static std::unique_ptr<ScratchFolder> folder_;
};
std::unique_ptr<RenderedCell> ReplayLineTest::cell_;
std::unique_ptr<ScratchFolder> ReplayLineTest::folder_;

TEST_F(ReplayLineTest, RecordsOneWholeFileAPart) {
  for (const char* name : {"calm", "lossy"}) {
    ASSERT_THAT(Logs(name), SizeIs(kParts));
    for (const std::string& log : Logs(name)) {
      EXPECT_THAT(Open({log}).findings(), IsEmpty()) << log;
    }
  }
}

TEST_F(ReplayLineTest, ASessionReplaysByteForByteWithAnyNumberOfThreads) {
  const RecordedSession session = Open(Logs("calm"));
  for (const char* threads : {"1", "2", "4"}) {
    SCOPED_TRACE(threads);
    const std::string value = std::string("threads=") + threads;
    ExpectSame(
        Compute(session, false,
                {.config = "", .values = {"reconstruction." + value, "registration." + value}, .files = {}}),
        session);
  }
}

TEST_F(ReplayLineTest, EachPartReplaysByItself) {
  for (const std::string& log : Logs("calm")) {
    SCOPED_TRACE(log);
    const RecordedSession session = Open({log});
    ExpectSame(Compute(session, false, {}), session);
  }
}

TEST_F(ReplayLineTest, ASessionRecordedWhileMessagesWereLostReplaysByteForByte) {
  const RecordedSession session = Open(Logs("lossy"));
  ExpectSame(Compute(session, false, {}), session);
}

TEST_F(ReplayLineTest, ASessionInWhichServicesWereKilledReplaysByteForByte) {
  const RecordedSession session = Open(Logs("killed"));
  for (const bool chained : {false, true}) {
    SCOPED_TRACE(chained ? "chained" : "each by itself");
    ExpectSame(Compute(session, chained, {}), session);
  }
}

TEST_F(ReplayLineTest, TheWholeChainComesToTheSameResults) {
  const RecordedSession session = Open(Logs("calm"));
  ExpectSame(Compute(session, true, {}), session);
}

TEST_F(ReplayLineTest, OneChangedBitOfOnePixelIsFoundAndNamed) {
  const std::string copy = (folder_->path() / "changed.lcmlog").string();
  fs::copy_file(Logs("calm")[1], copy, fs::copy_options::overwrite_existing);
  const auto log = LogReader::Open(copy);
  ASSERT_TRUE(log.ok());
  const auto frame = std::find_if(log->entries().begin(), log->entries().end(), [&](const auto& entry) {
    return log->ChannelOf(entry) == "FRAME_LEFT" && entry.number > 100;
  });
  ASSERT_NE(frame, log->entries().end());
  std::fstream file(copy, std::ios::in | std::ios::out | std::ios::binary);
  file.seekg(static_cast<std::streamoff>(frame->offset + 28 + 10 + frame->bytes / 2));
  const char pixel = static_cast<char>(file.peek() ^ 0x04);
  file.seekp(file.tellg());
  file.put(pixel);
  file.close();
  const RecordedSession session = Open({copy});
  const ReplayOutcome outcome = Compute(session, false, {});
  ASSERT_THAT(outcome.changed_inputs, SizeIs(1));
  EXPECT_THAT(outcome.changed_inputs[0], HasSubstr("FRAME_LEFT part 2 view "));
  EXPECT_THAT(outcome.changed_inputs[0], HasSubstr("is not as it was sent"));
  EXPECT_FALSE(outcome.comparison.Same());
}

TEST_F(ReplayLineTest, AChangedParameterIsFoundAndNamed) {
  const RecordedSession session = Open({Logs("calm")[0]});
  const StationChanges changes{
      .config = "", .values = {"reconstruction.publish_every_nth_point=9"}, .files = {}};
  auto scratch = ScratchFolder::Make();
  ASSERT_TRUE(scratch.ok());
  const auto station = UnpackStation(session, changes, scratch->path());
  ASSERT_TRUE(station.ok()) << station.error().message;
  EXPECT_THAT(*DescribeChanges(session, *station),
              ElementsAre(HasSubstr("reconstruction.publish_every_nth_point = 9, recorded as ")));
  const ReplayOutcome outcome = Compute(session, false, changes);
  EXPECT_GT(outcome.comparison.channels().at("VIEW_CLOUD").differing, 0);
  EXPECT_TRUE(outcome.comparison.channels().at("REGISTRATION").Same()) << "its own inputs are as recorded";
}

}  // namespace
}  // namespace forgescan
