// The counters of a report speak of its part alone, and nothing that a service said about the part's life is
// missing from them.
#include "services/report/report_service.h"
#include "tests/services/report/report_service_fixture.h"

namespace forgescan {
namespace {

class ReportCountersTest : public ReportServiceTest {
 protected:
  using ReportServiceTest::ReportServiceTest;
  void Say(const char* name, std::int64_t session, std::int64_t missing,
           std::int8_t state = fsmsg::service_state_t::STATE_READY) {
    fsmsg::service_state_t message{};
    message.utime = network_.NowUs();
    message.name = name;
    message.session = session;
    message.messages_missing = missing;
    message.state = state;
    ASSERT_TRUE(PublishState(line_.bus(), kServiceState, message).ok());
    network_.RunFor(1000);
  }
  // The rest of a part that has arrived, up to its verdict.
  void Judge(int part) {
    ASSERT_TRUE(line_.Publish(kFusionResult, Fusion(part)).ok());
    SendCloud(part);
    SendRegistration(part, fsmsg::registration_t::STATUS_CONVERGED);
    const std::size_t before = verdicts_.size();
    ASSERT_TRUE(network_.RunUntilTrue([&] { return verdicts_.size() > before; }, kSecondUs));
  }
  nlohmann::json Counters() const { return ReadJson(verdicts_.back())["counters"]; }
};

TEST_F(ReportCountersTest, OnlyWhatHappenedDuringThePartsLifeCounts) {
  Say("camera_left", 1, 2);
  Say("fusion", 1, 7);
  Arrive(1);
  network_.RunFor(kSecondUs);
  Say("camera_left", 1, 3);
  Say("camera_left", 2, 1);
  Judge(1);
  network_.RunFor(kSecondUs);
  Say("camera_left", 2, 1);
  Say("fusion", 1, 7);
  network_.RunFor(2 * kSecondUs);
  EXPECT_EQ(Counters()["messages_missing"], 2);
  EXPECT_EQ(Counters()["restarts"], 1);

  Judge(2);
  network_.RunFor(kSecondUs);
  Say("camera_left", 2, 1);
  Say("fusion", 1, 7);
  network_.RunFor(2 * kSecondUs);
  EXPECT_EQ(Counters()["messages_missing"], 0) << "what part 1 suffered is not part 2's";
  EXPECT_EQ(Counters()["restarts"], 0);
}

TEST_F(ReportCountersTest, ThePageWaitsForTheLastWordOfEveryService) {
  Say("camera_left", 1, 0);
  Judge(1);
  EXPECT_TRUE(Counters()["messages_missing"].is_null()) << "not known at the verdict";
  Say("camera_left", 1, 0);  // was still in the socket when the part was judged
  network_.RunFor(900'000);
  Say("camera_left", 1, 4);
  network_.RunFor(2 * kSecondUs);
  EXPECT_EQ(Counters()["messages_missing"], 4);
  EXPECT_EQ(Counters()["restarts"], 0);
}

TEST_F(ReportCountersTest, AServiceThatFellSilentMakesTheSumUnknownAndThePageComesAllTheSame) {
  Say("fusion", 1, 0);
  Judge(1);
  network_.RunFor(10 * kSecondUs);
  EXPECT_TRUE(std::filesystem::exists(folder_ / verdicts_[0].report_folder / "report.html"));
  EXPECT_TRUE(Counters()["messages_missing"].is_null());
  EXPECT_TRUE(Counters()["restarts"].is_null());
  EXPECT_EQ(Counters()["frames_lost"], 2);
}

TEST_F(ReportCountersTest, AServiceThatSaidItStopsIsNotWaitedFor) {
  Say("fusion", 1, 1);
  Arrive(1);
  Say("fusion", 1, 2, fsmsg::service_state_t::STATE_STOPPING);
  Judge(1);
  network_.RunFor(3 * kSecondUs);
  EXPECT_EQ(Counters()["messages_missing"], 1);
}

TEST_F(ReportCountersTest, FramesAreNotKnownWithoutTheFusionsWord) {
  Arrive(5);
  network_.RunFor(static_cast<std::int64_t>(config_.part_timeout_s + 5.0) * kSecondUs);
  ASSERT_EQ(verdicts_.size(), 1u);
  EXPECT_TRUE(Counters()["frames_expected"].is_null());
  EXPECT_TRUE(Counters()["frames_lost"].is_null());
  EXPECT_EQ(Counters()["messages_missing"], 0);
}

// A station with a camera beside the report, which hears itself.
class ReportCountersOfTwoTest : public ReportCountersTest {
 protected:
  ReportCountersOfTwoTest() : ReportCountersTest({"report", "camera_left"}) {}
};

TEST_F(ReportCountersOfTwoTest, NothingIsKnownOfAServiceThatWasNeverHeard) {
  Judge(1);
  network_.RunFor(10 * kSecondUs);
  EXPECT_TRUE(Counters()["messages_missing"].is_null());
  EXPECT_TRUE(Counters()["restarts"].is_null());
}

TEST_F(ReportCountersOfTwoTest, NorOfWhatItLostBeforeItsFirstWord) {
  Arrive(1);
  network_.RunFor(kSecondUs);
  Say("camera_left", 1, 3);
  Judge(1);
  network_.RunFor(kSecondUs);
  Say("camera_left", 1, 3);
  network_.RunFor(2 * kSecondUs);
  EXPECT_TRUE(Counters()["messages_missing"].is_null());

  Judge(2);
  network_.RunFor(kSecondUs);
  Say("camera_left", 1, 3);
  network_.RunFor(2 * kSecondUs);
  EXPECT_EQ(Counters()["messages_missing"], 0) << "the next part has heard it from the beginning";
  EXPECT_EQ(Counters()["restarts"], 0);
}

TEST(ServiceTally, AStateThatComesLateTakesNothingBack) {
  ServiceTally tally({"camera_left"});
  EXPECT_FALSE(tally.Sums().has_value());
  fsmsg::service_state_t state{};
  state.name = "camera_left";
  state.session = 2;
  for (const std::int64_t missing : {0, 3, 1}) {
    state.messages_missing = missing;
    tally.Note(state, 10);
  }
  EXPECT_EQ(tally.Sums()->messages_missing, 3);
  EXPECT_TRUE(tally.HeardSince(10));
  EXPECT_FALSE(tally.HeardSince(11));
}

}  // namespace
}  // namespace forgescan
