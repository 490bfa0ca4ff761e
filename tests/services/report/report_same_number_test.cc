// A line that counts from the beginning again: the same number is another part, and nothing of the earlier
// one gets into its report.
#include "services/report/report_service.h"
#include "tests/services/report/report_service_fixture.h"

namespace forgescan {
namespace {

constexpr std::int64_t kLaterUs = 100 * kSecondUs;

class ReportSameNumberTest : public ReportServiceTest {
 protected:
  // Messages of part 1, of a run of the line that began so much later than the first.
  void ArriveAgain(std::int64_t later_us) {
    fsmsg::part_arrived_t message{};
    message.utime = Fusion(1).scan_start_utime + later_us;
    message.part = 1;
    ASSERT_TRUE(line_.Publish(kPartArrived, message).ok());
    network_.RunFor(1000);
  }
  void FuseAgain(std::int64_t later_us) {
    fsmsg::fusion_result_t fusion = Fusion(1);
    fusion.utime += later_us;
    fusion.scan_start_utime += later_us;
    ASSERT_TRUE(line_.Publish(kFusionResult, fusion).ok());
    network_.RunFor(1000);
  }
  void CloudAgain(std::int64_t later_us) {
    for (const auto& slice : SliceCloud(cloud_, Fusion(1).utime + later_us, 1, kAllViews).value()) {
      ASSERT_TRUE(line_.Publish(kRegisteredCloud, slice).ok());
    }
    network_.RunFor(1000);
  }
  void RegisterAgain(std::int64_t later_us) {
    fsmsg::registration_t registration = Registration(1, fsmsg::registration_t::STATUS_CONVERGED);
    registration.utime += later_us;
    registration.points = static_cast<std::int32_t>(cloud_.size());
    ASSERT_TRUE(line_.Publish(kRegistration, registration).ok());
    network_.RunFor(1000);
  }
  void MeasureAgain(std::int64_t later_us) {
    FuseAgain(later_us);
    CloudAgain(later_us);
    RegisterAgain(later_us);
  }
  void WaitForTheTimeout() {
    network_.RunFor(static_cast<std::int64_t>(config_.part_timeout_s + 5.0) * kSecondUs);
  }
};

TEST_F(ReportSameNumberTest, AnUnfinishedPartGetsItsVerdictAndLeavesNothingBehind) {
  Arrive(1);
  ASSERT_TRUE(line_.Publish(kFusionResult, Fusion(1)).ok());
  network_.RunFor(kSecondUs);
  ArriveAgain(kLaterUs);
  ASSERT_EQ(verdicts_.size(), 1u);
  EXPECT_EQ(verdicts_[0].verdict, fsmsg::verdict_t::VERDICT_NOT_INSPECTED);
  SendCloud(1);  // late, of the earlier part
  SendRegistration(1, fsmsg::registration_t::STATUS_FAILED);
  network_.RunFor(kSecondUs);
  EXPECT_EQ(verdicts_.size(), 1u);
  MeasureAgain(kLaterUs);
  ASSERT_EQ(verdicts_.size(), 2u);
  EXPECT_EQ(verdicts_[1].verdict, fsmsg::verdict_t::VERDICT_OK) << verdicts_[1].reason;
  EXPECT_EQ(verdicts_[1].utime, Fusion(1).utime + kLaterUs);
}

TEST_F(ReportSameNumberTest, AFinishedPartIsFollowedByAnotherAlsoOnAClockSetBack) {
  SendGood(1);
  network_.RunFor(kSecondUs);
  for (const std::int64_t later_us : {kLaterUs, -3600 * kSecondUs}) {
    const std::size_t before = verdicts_.size();
    ArriveAgain(later_us);
    MeasureAgain(later_us);
    ASSERT_EQ(verdicts_.size(), before + 1);
    EXPECT_EQ(verdicts_.back().verdict, fsmsg::verdict_t::VERDICT_OK) << verdicts_.back().reason;
    EXPECT_EQ(verdicts_.back().utime, Fusion(1).utime + later_us);
  }
}

TEST_F(ReportSameNumberTest, APartWhoseArrivalWasNotSeenIsNotJoinedWithTheNext) {
  ASSERT_TRUE(line_.Publish(kFusionResult, Fusion(1)).ok());
  network_.RunFor(kSecondUs);
  ArriveAgain(kLaterUs);
  ASSERT_EQ(verdicts_.size(), 1u);
  EXPECT_EQ(verdicts_[0].verdict, fsmsg::verdict_t::VERDICT_NOT_INSPECTED);
  MeasureAgain(kLaterUs);
  ASSERT_EQ(verdicts_.size(), 2u);
  EXPECT_EQ(ReadJson(verdicts_[1])["arrived_utime"], Fusion(1).scan_start_utime + kLaterUs);
}

TEST_F(ReportSameNumberTest, AnArrivalThatComesLateIsStillThePartsOwn) {
  ASSERT_TRUE(line_.Publish(kFusionResult, Fusion(1)).ok());
  network_.RunFor(kSecondUs);
  Arrive(1);
  network_.RunFor(1000);
  EXPECT_TRUE(verdicts_.empty());
  MeasureAgain(0);
  ASSERT_EQ(verdicts_.size(), 1u);
  EXPECT_EQ(verdicts_[0].verdict, fsmsg::verdict_t::VERDICT_OK) << verdicts_[0].reason;
}

TEST_F(ReportSameNumberTest, ACloudOfAnotherScanIsNotJudgedWithThisPartsPose) {
  FuseAgain(0);
  CloudAgain(kLaterUs);
  RegisterAgain(0);
  WaitForTheTimeout();
  ASSERT_EQ(verdicts_.size(), 2u) << "two scans ended";
  for (const fsmsg::verdict_t& verdict : verdicts_) {
    EXPECT_EQ(verdict.verdict, fsmsg::verdict_t::VERDICT_NOT_INSPECTED);
  }
  EXPECT_EQ(verdicts_[0].utime, Fusion(1).utime);
  EXPECT_EQ(verdicts_[1].utime, Fusion(1).utime + kLaterUs);
}

TEST_F(ReportSameNumberTest, FramesAndViewsOfAnotherScanAreNotThisParts) {
  FuseAgain(0);
  CloudAgain(kLaterUs);
  RegisterAgain(kLaterUs);
  WaitForTheTimeout();
  ASSERT_EQ(verdicts_.size(), 2u);
  EXPECT_EQ(verdicts_[0].verdict, fsmsg::verdict_t::VERDICT_NOT_INSPECTED);
  EXPECT_EQ(verdicts_[0].utime, Fusion(1).utime);
  EXPECT_EQ(verdicts_[1].verdict, fsmsg::verdict_t::VERDICT_OK) << verdicts_[1].reason;
  EXPECT_TRUE(ReadJson(verdicts_[1])["counters"]["frames_lost"].is_null());
}

TEST_F(ReportSameNumberTest, AResultOfAnEarlierScanIsNotTaken) {
  FuseAgain(kLaterUs);
  CloudAgain(0);
  RegisterAgain(0);
  FuseAgain(0);
  EXPECT_TRUE(verdicts_.empty());
  CloudAgain(kLaterUs);
  RegisterAgain(kLaterUs);
  ASSERT_EQ(verdicts_.size(), 1u);
  EXPECT_EQ(verdicts_[0].verdict, fsmsg::verdict_t::VERDICT_OK) << verdicts_[0].reason;
  EXPECT_EQ(verdicts_[0].utime, Fusion(1).utime + kLaterUs);
}

TEST_F(ReportSameNumberTest, APartWhoseArrivalWasLostAfterAFinishedOneGetsItsVerdict) {
  SendGood(1);
  network_.RunFor(kSecondUs);
  MeasureAgain(kLaterUs);
  MeasureAgain(0);  // late, of the first
  WaitForTheTimeout();
  ASSERT_EQ(verdicts_.size(), 2u);
  EXPECT_EQ(verdicts_[1].verdict, fsmsg::verdict_t::VERDICT_OK) << verdicts_[1].reason;
  EXPECT_EQ(verdicts_[1].utime, Fusion(1).utime + kLaterUs);
}

TEST_F(ReportSameNumberTest, AndIsNotInspectedIfNothingMoreComesOfIt) {
  SendGood(1);
  network_.RunFor(kSecondUs);
  FuseAgain(kLaterUs);
  WaitForTheTimeout();
  ASSERT_EQ(verdicts_.size(), 2u);
  EXPECT_EQ(verdicts_[1].verdict, fsmsg::verdict_t::VERDICT_NOT_INSPECTED);
}

// A duration carries the time of what the step worked on: a view, or the end of the scan.
TEST_F(ReportSameNumberTest, DurationsGoToThePartTheyAreOf) {
  SendGood(1);
  network_.RunFor(1000);
  ArriveAgain(kLaterUs);
  SendDuration(kReconstructionTime, "reconstruction", 1, 30'000, -10 * kSecondUs);  // of the earlier part,
  SendDuration(kFusionTime, "fusion", 1, 80'000);                                   // whose page is still due
  SendDuration(kReconstructionTime, "reconstruction", 1, 500'000, kLaterUs - 10 * kSecondUs);
  MeasureAgain(kLaterUs);
  SendDuration(kRegistrationTime, "registration", 1, 310'000, kLaterUs);
  network_.RunFor(3 * kSecondUs);
  ASSERT_EQ(verdicts_.size(), 2u);
  const nlohmann::json first = ReadJson(verdicts_[0])["timing_s"],
                       second = ReadJson(verdicts_[1])["timing_s"];
  EXPECT_EQ(first["reconstruction"], 0.03);
  EXPECT_EQ(first["fusion"], 0.08);
  EXPECT_TRUE(first["registration"].is_null());
  EXPECT_EQ(second["reconstruction"], 0.5);
  EXPECT_TRUE(second["fusion"].is_null());
  EXPECT_EQ(second["registration"], 0.31);
}

TEST_F(ReportSameNumberTest, ADurationOfAPartThatIsDoneAndWrittenIsNotTheNextOnes) {
  SendGood(1);
  network_.RunFor(3 * kSecondUs);
  ArriveAgain(kLaterUs);
  SendDuration(kFusionTime, "fusion", 1, 80'000);
  MeasureAgain(kLaterUs);
  network_.RunFor(3 * kSecondUs);
  ASSERT_EQ(verdicts_.size(), 2u);
  EXPECT_TRUE(ReadJson(verdicts_[1])["timing_s"]["fusion"].is_null());
}

}  // namespace
}  // namespace forgescan
