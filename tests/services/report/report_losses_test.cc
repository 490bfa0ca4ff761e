// A message given up ends the part that lacks it, and no other.
#include "services/report/report_service.h"
#include "tests/services/report/report_service_fixture.h"

namespace forgescan {
namespace {

constexpr std::size_t kTwoSlices = 140'000;  // points
// Keeps one cloud, and sends it again in 4.4 s: twice the time after which the service looks at losses.
constexpr StreamOptions kSlowSender{
    .history_bytes = 4'500'000, .burst_bytes = 4'500'000, .piece_gap_us = 50'000};

class ReportLossesTest : public ReportServiceTest {
 protected:
  ReportLossesTest() {
    cloud_.points.assign(kTwoSlices, {1, 2, 3});
    cloud_.points[0].x() = 1885;
    cloud_.normals.assign(kTwoSlices, {0, 0, 1});
    cloud_.sigma_mm.assign(kTwoSlices, 0.02F);
    cloud_.view.assign(kTwoSlices, 0);
    registration_.Advertise(kRegisteredCloud);
    network_.RunFor(kSecondUs);
  }
  void SendLargeCloud(int part) {
    for (const auto& slice : SliceCloud(cloud_, Fusion(part).utime, part, kAllViews).value()) {
      ASSERT_TRUE(registration_.Publish(kRegisteredCloud, slice).ok());
    }
  }
  std::int8_t VerdictOn(int part) const {
    const auto found = std::find_if(verdicts_.begin(), verdicts_.end(),
                                    [part](const auto& verdict) { return verdict.part == part; });
    return found == verdicts_.end() ? fsmsg::verdict_t::VERDICT_UNKNOWN : found->verdict;
  }

  StreamHub registration_{network_.AddNode(), "registration", kSlowSender};
};

TEST_F(ReportLossesTest, ALossOfOnePartLeavesTheOtherItsTime) {
  for (const int part : {1, 2}) {
    Arrive(part);
    ASSERT_TRUE(line_.Publish(kFusionResult, Fusion(part)).ok());
    SendRegistration(part, fsmsg::registration_t::STATUS_CONVERGED);
  }
  network_.RunFor(kSecondUs);
  network_.SetFaults({.large_loss = 1.0});
  SendLargeCloud(1);  // and the sender keeps nothing of it
  SendLargeCloud(2);
  network_.RunFor(3 * kSecondUs);
  EXPECT_EQ(monitor_.counter("holes"), 1);
  EXPECT_TRUE(verdicts_.empty()) << "slices are under way";
  network_.RunFor(7 * kSecondUs);
  EXPECT_EQ(VerdictOn(2), fsmsg::verdict_t::VERDICT_OK);
  EXPECT_EQ(VerdictOn(1), fsmsg::verdict_t::VERDICT_NOT_INSPECTED) << "and long before the part's timeout";
}

TEST_F(ReportLossesTest, APartThatLacksSomethingElseIsNotEndedByALoss) {
  Arrive(1);
  Arrive(2);
  SendRegistration(2, fsmsg::registration_t::STATUS_FAILED);  // lacks the fusion's result, which is only late
  network_.RunFor(kSecondUs);
  network_.SetFaults({.large_loss = 1.0});
  SendLargeCloud(1);
  SendLargeCloud(3);
  network_.RunFor(20 * kSecondUs);
  EXPECT_EQ(monitor_.counter("holes"), 1);
  EXPECT_TRUE(verdicts_.empty());
  ASSERT_TRUE(line_.Publish(kFusionResult, Fusion(2)).ok());
  network_.RunFor(2 * kSecondUs);
  ASSERT_EQ(verdicts_.size(), 1u);
  EXPECT_EQ(ReadJson(verdicts_[0])["counters"]["frames_lost"], 2) << "with the fusion's word";
}

TEST_F(ReportLossesTest, ARegistrationAfterTheLossEndsThePartToo) {
  Arrive(1);
  ASSERT_TRUE(line_.Publish(kFusionResult, Fusion(1)).ok());
  network_.SetFaults({.large_loss = 1.0});
  SendLargeCloud(1);
  SendLargeCloud(3);
  network_.RunFor(20 * kSecondUs);
  EXPECT_TRUE(verdicts_.empty());
  SendRegistration(1, fsmsg::registration_t::STATUS_CONVERGED);
  network_.RunFor(6 * kSecondUs);
  EXPECT_EQ(VerdictOn(1), fsmsg::verdict_t::VERDICT_NOT_INSPECTED);
}

TEST_F(ReportLossesTest, FurtherLossesDoNotPutTheVerdictOff) {
  StreamHub fusion(network_.AddNode(), "fusion",
                   {.history_bytes = 1, .burst_bytes = 1});  // keeps one message
  fusion.Advertise(kFusionResult);
  Arrive(1);
  network_.RunFor(kSecondUs);
  SendCloud(1);
  SendRegistration(1, fsmsg::registration_t::STATUS_CONVERGED);
  network_.RunFor(kSecondUs);
  for (int i = 0; i < 8; ++i) {
    network_.SetFaults({.loss = 1.0});
    ASSERT_TRUE(fusion.Publish(kFusionResult, Fusion(i == 0 ? 1 : 100 + i)).ok());
    network_.RunFor(1000);
    network_.SetFaults({});
    ASSERT_TRUE(fusion.Publish(kFusionResult, Fusion(200 + i)).ok());
    network_.RunFor(1'300'000);  // sooner than the service looks, and not in step with it
  }
  EXPECT_EQ(monitor_.counter("holes"), 8);
  EXPECT_EQ(VerdictOn(1), fsmsg::verdict_t::VERDICT_OK);
}

}  // namespace
}  // namespace forgescan
