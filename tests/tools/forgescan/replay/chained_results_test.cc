#include "tools/forgescan/replay/chained_results.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/tools/forgescan/replay/written_recording.h"

namespace forgescan {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;
using testing::kSession;
using testing::TestFolder;
using testing::WrittenRecording;

// Two verdicts are recorded of one event, and none of any other.
class ChainedResultsTest : public ::testing::Test {
 protected:
  static constexpr std::int64_t kEvent = kSession + 10, kOther = kSession + 20;

  static fsmsg::verdict_t Verdict(int part, std::int64_t utime) {
    fsmsg::verdict_t message{};
    message.utime = utime;
    message.part = part;
    return message;
  }
  void SetUp() override {
    WrittenRecording recording(folder_ / "one.lcmlog");
    recording.Stream(kVerdict, Verdict(1, kEvent), 1);
    recording.Stream(kVerdict, Verdict(2, kEvent), 2);
    recording.Close();
    auto session = RecordedSession::Open({folder_ / "one.lcmlog"});
    ASSERT_TRUE(session.ok()) << session.error().message;
    session_.emplace(std::move(*session));
    auto comparison = ResultComparison::Create(*session_, {"VERDICT"});
    ASSERT_TRUE(comparison.ok()) << comparison.error().message;
    comparison_.emplace(std::move(*comparison));
    chain_.emplace(*comparison_);
  }
  void Add(int part, std::int64_t utime) {
    const Status added = chain_->Add("VERDICT", Encode(Verdict(part, utime)));
    ASSERT_TRUE(added.ok()) << added.error().message;
  }
  // The parts of those whose turn has come.
  std::vector<int> Taken() {
    std::vector<int> parts;
    while (const auto due = chain_->Take()) {
      EXPECT_EQ(due->first, "VERDICT");
      parts.push_back(Decode<fsmsg::verdict_t>(due->second)->part);
    }
    return parts;
  }

  const TestFolder folder_;
  std::optional<RecordedSession> session_;
  std::optional<ResultComparison> comparison_;
  std::optional<ChainedResults> chain_;
};

TEST_F(ChainedResultsTest, AResultWaitsForItsPlaceInTheRecord) {
  Add(1, kEvent);
  Add(2, kEvent);
  EXPECT_THAT(Taken(), IsEmpty());
  chain_->Pass("VERDICT", kEvent);
  EXPECT_THAT(Taken(), ElementsAre(1));
  chain_->Pass("VERDICT", kEvent);
  EXPECT_THAT(Taken(), ElementsAre(2));
}

TEST_F(ChainedResultsTest, AResultWhosePlaceIsPassedComesAtOnce) {
  chain_->Pass("VERDICT", kEvent);
  EXPECT_THAT(Taken(), IsEmpty());
  Add(1, kEvent);
  EXPECT_THAT(Taken(), ElementsAre(1));
  Add(2, kEvent);
  EXPECT_THAT(Taken(), IsEmpty()) << "its place is still to come";
}

TEST_F(ChainedResultsTest, MoreThanRecordedComeWithTheLastInTheirOrder) {
  for (const int part : {1, 2, 3}) {
    Add(part, kEvent);
  }
  chain_->Pass("VERDICT", kEvent);
  EXPECT_THAT(Taken(), ElementsAre(1));
  chain_->Pass("VERDICT", kEvent);
  EXPECT_THAT(Taken(), ElementsAre(2, 3));
}

TEST_F(ChainedResultsTest, OneOfAnEventWithoutAPlaceComesAtOnce) {
  Add(9, kOther);
  EXPECT_THAT(Taken(), ElementsAre(9));
  EXPECT_FALSE(chain_->Add("VERDICT", Bytes{1, 2, 3}).ok());
}

}  // namespace
}  // namespace forgescan
