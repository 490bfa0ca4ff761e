#include "tools/forgescan/replay/result_comparison.h"

#include <gtest/gtest.h>

#include "tests/tools/forgescan/replay/written_recording.h"

namespace forgescan {
namespace {

using testing::kSession;
using testing::TestFolder;
using testing::WrittenRecording;

// Two verdicts at one time and one later, as a recording has them.
class ResultComparisonTest : public ::testing::Test {
 protected:
  static fsmsg::verdict_t Verdict(int part, std::int64_t after_us) {
    fsmsg::verdict_t message{};
    message.utime = kSession + after_us;
    message.part = part;
    message.verdict = fsmsg::verdict_t::VERDICT_OK;
    return message;
  }
  void SetUp() override {
    WrittenRecording recording(folder_ / "one.lcmlog");
    recording.Stream(kVerdict, Verdict(1, 10), 41);
    recording.Stream(kVerdict, Verdict(2, 10), 42);
    recording.Stream(kVerdict, Verdict(3, 20), 43);
    recording.Close();
    auto session = RecordedSession::Open({folder_ / "one.lcmlog"});
    ASSERT_TRUE(session.ok()) << session.error().message;
    session_.emplace(std::move(*session));
    auto comparison = ResultComparison::Create(*session_, {"VERDICT", "REGISTRATION"});
    ASSERT_TRUE(comparison.ok()) << comparison.error().message;
    comparison_.emplace(std::move(*comparison));
  }
  // Replays a message with a numbering of its own.
  void Replay(const fsmsg::verdict_t& message) {
    Bytes bytes = Encode(message);
    ASSERT_TRUE(StampStreamHeader(bytes, {7, 1}).ok());
    const Status added = comparison_->Add("VERDICT", bytes);
    ASSERT_TRUE(added.ok()) << added.error().message;
  }
  const ChannelComparison& Counts() const { return comparison_->channels().at("VERDICT"); }

  TestFolder folder_;
  std::optional<RecordedSession> session_;
  std::optional<ResultComparison> comparison_;
};

TEST_F(ResultComparisonTest, EqualMessagesAreEqualWhateverTheirNumbering) {
  for (const auto& message : {Verdict(3, 20), Verdict(1, 10), Verdict(2, 10)}) {
    Replay(message);
  }
  ASSERT_TRUE(comparison_->Finish().ok());
  EXPECT_EQ(Counts().equal, 3);
  EXPECT_TRUE(comparison_->Same());
  EXPECT_FALSE(comparison_->first_difference().has_value());
}

TEST_F(ResultComparisonTest, OneFieldThatDiffersIsADifference) {
  auto wrong = Verdict(2, 10);
  wrong.verdict = fsmsg::verdict_t::VERDICT_NOT_OK;
  Replay(Verdict(1, 10));
  Replay(wrong);
  Replay(Verdict(3, 20));
  ASSERT_TRUE(comparison_->Finish().ok());
  EXPECT_EQ(Counts().equal, 2);
  EXPECT_EQ(Counts().differing, 1);
  EXPECT_FALSE(comparison_->Same());
  ASSERT_TRUE(comparison_->first_difference().has_value());
  const auto recorded = Decode<fsmsg::verdict_t>(comparison_->first_difference()->recorded);
  ASSERT_TRUE(recorded.ok());
  EXPECT_EQ(recorded->part, 2);
  EXPECT_EQ(recorded->sequence, 42);
}

TEST_F(ResultComparisonTest, CountsWhatIsMissingAndWhatIsMore) {
  Replay(Verdict(1, 10));
  Replay(Verdict(9, 30));
  ASSERT_TRUE(comparison_->Finish().ok());
  EXPECT_EQ(Counts().equal, 1);
  EXPECT_EQ(Counts().missing, 2);
  EXPECT_EQ(Counts().extra, 1);
  EXPECT_FALSE(comparison_->Same());
}

TEST(ResultComparison, ARecordedResultThatWasChangedIsADifferenceAndNamed) {
  const TestFolder folder;
  fsmsg::verdict_t verdict{};
  verdict.utime = kSession + 10;
  WrittenRecording recording(folder / "one.lcmlog");
  Bytes bytes = recording.Stream(kVerdict, verdict, 1);
  recording.CloseAfter([](auto& events) { events[1].message.back() ^= 1; });
  const auto session = RecordedSession::Open({folder / "one.lcmlog"});
  ASSERT_TRUE(session.ok()) << session.error().message;
  auto comparison = ResultComparison::Create(*session, {"VERDICT"});
  ASSERT_TRUE(comparison.ok());
  const Status added = comparison->Add("VERDICT", bytes);
  ASSERT_TRUE(added.ok()) << added.error().message;
  ASSERT_TRUE(comparison->Finish().ok());
  EXPECT_EQ(comparison->Total().differing, 1);
  ASSERT_EQ(comparison->changed_records().size(), 1u);
  EXPECT_NE(comparison->changed_records()[0].find("VERDICT"), std::string::npos);
}

TEST(ResultComparison, ARecordedResultWithAWrongBitInItsTimeIsMissingAndNamed) {
  const TestFolder folder;
  fsmsg::verdict_t verdict{};
  verdict.utime = kSession + 10;
  WrittenRecording recording(folder / "one.lcmlog");
  const Bytes bytes = recording.Stream(kVerdict, verdict, 1);
  recording.CloseAfter([](auto& events) { events[1].message[15] ^= 1; });  // fingerprint, utime
  const auto session = RecordedSession::Open({folder / "one.lcmlog"});
  ASSERT_TRUE(session.ok()) << session.error().message;
  auto comparison = ResultComparison::Create(*session, {"VERDICT"});
  ASSERT_TRUE(comparison.ok());
  ASSERT_TRUE(comparison->Add("VERDICT", bytes).ok());
  ASSERT_TRUE(comparison->Finish().ok());
  EXPECT_EQ(comparison->Total().missing, 1);
  EXPECT_EQ(comparison->Total().extra, 1);
  EXPECT_EQ(comparison->changed_records().size(), 1u);
}

TEST_F(ResultComparisonTest, NothingComparedIsNotTheSame) {
  auto nothing = ResultComparison::Create(*session_, {"REGISTRATION"});
  ASSERT_TRUE(nothing.ok());
  ASSERT_TRUE(nothing->Finish().ok());
  EXPECT_FALSE(nothing->Same());
}

}  // namespace
}  // namespace forgescan
