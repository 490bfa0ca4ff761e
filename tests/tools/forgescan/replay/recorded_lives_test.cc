#include "tools/forgescan/replay/recorded_lives.h"

#include <gtest/gtest.h>

#include "tests/tools/forgescan/replay/written_recording.h"

namespace forgescan {
namespace {

using testing::kSession;
using testing::TestFolder;
using testing::WrittenRecording;
using State = fsmsg::service_state_t;
using End = RecordedLife::End;

constexpr std::int64_t kSecondUs = 1'000'000;

// Words of the report service; times in s after the beginning, sessions as the second of the start.
class RecordedLivesTest : public ::testing::Test {
 protected:
  void Word(double after_s, int session, std::int8_t state) {
    State message{};
    message.utime = Us(after_s);
    message.session = Us(session);
    message.name = "report";
    message.state = state;
    recording_.State(kServiceState, message);
  }
  // An input: a message of another service.
  void Input(double after_s) {
    fsmsg::part_arrived_t message{};
    message.utime = Us(after_s);
    recording_.Stream(kPartArrived, message, ++sequence_);
  }
  void Verdict(double after_s, int session, double event_s) {
    fsmsg::verdict_t message{};
    message.utime = Us(event_s);
    Bytes bytes = Encode(message);
    ASSERT_TRUE(StampStreamHeader(bytes, {Us(session), ++sequence_}).ok());
    recording_.Write(kVerdict.name, bytes, Us(after_s));
  }
  std::vector<RecordedLife> Lives() {
    recording_.Close();
    const auto session = RecordedSession::Open({folder_ / "one.lcmlog"});
    EXPECT_TRUE(session.ok()) << session.error().message;
    const auto lives = LivesOf(*session, *SelectServices({"report"}));
    EXPECT_TRUE(lives.ok()) << lives.error().message;
    return lives->at(0);
  }
  static std::int64_t Us(double after_s) {
    return kSession + static_cast<std::int64_t>(after_s * static_cast<double>(kSecondUs));
  }

  const TestFolder folder_;
  WrittenRecording recording_{folder_ / "one.lcmlog"};
  std::int64_t sequence_ = 0;
};

TEST_F(RecordedLivesTest, OneThatSaysNothingOfItselfLivesThroughout) {
  Input(1);
  const auto lives = Lives();
  ASSERT_EQ(lives.size(), 1u);
  EXPECT_TRUE(lives[0].listened);
  EXPECT_FALSE(lives[0].begin.has_value());
  EXPECT_EQ(lives[0].how, End::kRunsOn);
}

TEST_F(RecordedLivesTest, AKilledOneMayHaveHeardUntilItsNextWordWasDue) {
  Word(1, -9, State::STATE_READY);    // event 0
  Verdict(1.5, -9, 0.5);              // 1
  Word(2, -9, State::STATE_WORKING);  // 2
  Input(2.4);                         // 3
  Input(2.9);                         // 4: when the next word was due at 3.0
  Input(3.1);                         // 5
  Word(6, 5, State::STATE_STARTING);  // 6
  Input(6.1);                         // 7: while it loads its files
  Verdict(6.5, 5, 2);                 // 8: its first word that shows that it listens
  Word(6.6, 5, State::STATE_READY);   // 9
  const auto lives = Lives();
  ASSERT_EQ(lives.size(), 2u);
  EXPECT_FALSE(lives[0].begin.has_value());
  EXPECT_EQ(lives[0].how, End::kKilled);
  EXPECT_EQ(lives[0].last_word, 2u);
  EXPECT_EQ(lives[0].end, 4u);
  EXPECT_EQ(lives[0].last_utime.at("VERDICT"), Us(0.5));
  EXPECT_EQ(lives[1].begin, 8u);
  EXPECT_EQ(lives[1].how, End::kRunsOn);
}

TEST_F(RecordedLivesTest, ItHeardNothingAfterTheNextOneStarted) {
  Word(1, -9, State::STATE_READY);      // 0
  Word(2, -9, State::STATE_READY);      // 1
  Input(2.1);                           // 2
  Word(2.5, 2, State::STATE_STARTING);  // 3
  Input(2.6);
  Word(2.7, 2, State::STATE_READY);
  EXPECT_EQ(Lives()[0].end, 1u) << "the next one started at 2.0 s, before the input";
}

TEST_F(RecordedLivesTest, AStoppedOneEndsWithItsWordAndWhatItSaysThenCounts) {
  Word(1, -9, State::STATE_READY);     // 0
  Word(2, -9, State::STATE_STOPPING);  // 1
  Verdict(2.1, -9, 1);                 // 2
  Word(4, 3, State::STATE_STARTING);
  Word(5, 3, State::STATE_READY);
  const auto lives = Lives();
  ASSERT_EQ(lives.size(), 2u);
  EXPECT_EQ(lives[0].how, End::kStopped);
  EXPECT_EQ(lives[0].end, 1u);
}

TEST_F(RecordedLivesTest, OneThatNeverGotPastStartingListenedToNothing) {
  Word(1, -9, State::STATE_READY);
  Word(2, -9, State::STATE_READY);
  Word(3, 3, State::STATE_STARTING);
  Word(4, 3, State::STATE_STARTING);
  Word(5, 5, State::STATE_STARTING);
  Word(6, 5, State::STATE_READY);
  const auto lives = Lives();
  ASSERT_EQ(lives.size(), 3u);
  EXPECT_FALSE(lives[1].listened);
  EXPECT_EQ(lives[2].begin, 5u);
}

TEST_F(RecordedLivesTest, OneWrongBitInASessionIsNoLife) {
  Word(1, -9, State::STATE_READY);
  Word(2, 4711, State::STATE_READY);
  Word(3, -9, State::STATE_READY);
  const auto lives = Lives();
  ASSERT_EQ(lives.size(), 1u);
  EXPECT_EQ(lives[0].how, End::kRunsOn);
}

}  // namespace
}  // namespace forgescan
