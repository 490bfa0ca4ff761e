// The service on a simulated bus: every part ends with exactly one verdict, whatever comes and whatever is
// missing.
#include "services/report/report_service.h"

#include "tests/services/report/report_service_fixture.h"

namespace forgescan {
namespace {

TEST_F(ReportServiceTest, Starts) { EXPECT_EQ(monitor_.state(), ServiceState::kReady); }

TEST_F(ReportServiceTest, AGoodPartIsOkAndReported) {
  SendDuration(kReconstructionTime, "reconstruction", 12, 300'000);
  SendDuration(kReconstructionTime, "reconstruction", 12, 200'000);
  SendGood(12);
  SendDuration(kRegistrationTime, "registration", 12, 310'000);  // comes after the verdict
  network_.RunFor(3 * kSecondUs);
  ASSERT_EQ(verdicts_.size(), 1u);
  const fsmsg::verdict_t& verdict = verdicts_[0];
  EXPECT_EQ(verdict.verdict, fsmsg::verdict_t::VERDICT_OK) << verdict.reason;
  EXPECT_EQ(verdict.utime, Registration(12, 0).utime);
  EXPECT_EQ(verdict.report_folder, ReportFolderName(12, verdict.utime));
  ASSERT_EQ(verdict.dimension_count, 1);
  const auto report = ReadJson(verdict);
  EXPECT_EQ(report["verdict"], "OK");
  EXPECT_EQ(report["dimensions"][0]["measured_mm"], verdict.dimensions[0].measured_mm);
  EXPECT_EQ(report["timing_s"]["reconstruction"], 0.5);
  EXPECT_EQ(report["timing_s"]["registration"], 0.31);
  EXPECT_EQ(report["timing_s"]["scan"], 27.0);
  EXPECT_EQ(report["counters"]["frames_lost"], 2);
  EXPECT_TRUE(std::filesystem::exists(folder_ / verdict.report_folder / "report.html"));
  EXPECT_TRUE(std::filesystem::exists(folder_ / "index.html"));
  EXPECT_EQ(monitor_.last_error(), "");
  EXPECT_EQ(monitor_.state(), ServiceState::kReady);
}

TEST_F(ReportServiceTest, OrderOfMessagesDoesNotMatter) {
  SendRegistration(3, fsmsg::registration_t::STATUS_CONVERGED);
  network_.RunFor(kSecondUs);
  SendCloud(3);
  network_.RunFor(kSecondUs);
  EXPECT_TRUE(verdicts_.empty()) << "the fusion's word is missing";
  ASSERT_TRUE(line_.Publish(kFusionResult, Fusion(3)).ok());
  network_.RunFor(kSecondUs);
  ASSERT_EQ(verdicts_.size(), 1u);
  EXPECT_EQ(verdicts_[0].verdict, fsmsg::verdict_t::VERDICT_OK);
}

TEST_F(ReportServiceTest, AFailedRegistrationIsNotInspectedWithItsReason) {
  Arrive(4);
  ASSERT_TRUE(line_.Publish(kFusionResult, Fusion(4)).ok());
  SendRegistration(4, fsmsg::registration_t::STATUS_FAILED);
  network_.RunFor(3 * kSecondUs);
  ASSERT_EQ(verdicts_.size(), 1u);
  EXPECT_EQ(verdicts_[0].verdict, fsmsg::verdict_t::VERDICT_NOT_INSPECTED);
  EXPECT_EQ(verdicts_[0].reason, "The start lies 40 mm off.");
  EXPECT_TRUE(std::isnan(verdicts_[0].dimensions.at(0).measured_mm));
  EXPECT_EQ(ReadJson(verdicts_[0])["registration"]["status"], "FAILED");
  EXPECT_TRUE(ReadJson(verdicts_[0])["registration"]["model_from_array"].is_null());
}

TEST_F(ReportServiceTest, NothingAfterTheArrivalEndsInATimeout) {
  Arrive(5);
  network_.RunFor(static_cast<std::int64_t>(config_.part_timeout_s - 2.0) * kSecondUs);
  EXPECT_TRUE(verdicts_.empty());
  network_.RunFor(5 * kSecondUs);
  ASSERT_EQ(verdicts_.size(), 1u);
  EXPECT_EQ(verdicts_[0].verdict, fsmsg::verdict_t::VERDICT_NOT_INSPECTED);
  EXPECT_EQ(verdicts_[0].utime, Fusion(5).scan_start_utime) << "the time of the event, not of the timeout";
  EXPECT_NE(verdicts_[0].reason.find("not completed in time"), std::string::npos);
  EXPECT_EQ(monitor_.counter("parts_timed_out"), 1);
  SendGood(6);
  network_.RunFor(kSecondUs);
  EXPECT_EQ(verdicts_.size(), 2u) << "still works after the timeout";
  EXPECT_EQ(verdicts_.back().verdict, fsmsg::verdict_t::VERDICT_OK);
}

TEST_F(ReportServiceTest, WhatComesTooLateChangesNothing) {
  Arrive(5);
  network_.RunFor(static_cast<std::int64_t>(config_.part_timeout_s + 2.0) * kSecondUs);
  ASSERT_TRUE(line_.Publish(kFusionResult, Fusion(5)).ok());
  SendCloud(5);
  SendRegistration(5, fsmsg::registration_t::STATUS_CONVERGED);
  network_.RunFor(2 * static_cast<std::int64_t>(config_.part_timeout_s) * kSecondUs);
  EXPECT_EQ(verdicts_.size(), 1u);
}

TEST_F(ReportServiceTest, NorDoesTheEndOfAScanThatTookLongerThanThePartsTime) {
  Arrive(5);
  network_.RunFor(static_cast<std::int64_t>(config_.part_timeout_s + 2.0) * kSecondUs);
  fsmsg::scan_complete_t scan{};
  scan.scan_start_utime = Fusion(5).scan_start_utime;
  scan.utime = scan.scan_start_utime + static_cast<std::int64_t>(config_.part_timeout_s + 10.0) * kSecondUs;
  scan.part = 5;
  ASSERT_TRUE(line_.Publish(kScanComplete, scan).ok());
  network_.RunFor(kSecondUs);
  fsmsg::registration_t registration = Registration(5, fsmsg::registration_t::STATUS_FAILED);
  registration.utime = scan.utime;
  ASSERT_TRUE(line_.Publish(kRegistration, registration).ok());
  network_.RunFor(2 * static_cast<std::int64_t>(config_.part_timeout_s) * kSecondUs);
  EXPECT_EQ(verdicts_.size(), 1u);
}

TEST_F(ReportServiceTest, TwoPartsInterleaved) {
  Arrive(7);
  Arrive(8);
  ASSERT_TRUE(line_.Publish(kFusionResult, Fusion(8)).ok());
  SendCloud(7);
  ASSERT_TRUE(line_.Publish(kFusionResult, Fusion(7)).ok());
  SendRegistration(8, fsmsg::registration_t::STATUS_FAILED);
  network_.RunFor(kSecondUs);
  SendRegistration(7, fsmsg::registration_t::STATUS_CONVERGED);
  network_.RunFor(kSecondUs);
  ASSERT_EQ(verdicts_.size(), 2u);
  EXPECT_EQ(verdicts_[0].part, 8);
  EXPECT_EQ(verdicts_[0].verdict, fsmsg::verdict_t::VERDICT_NOT_INSPECTED);
  EXPECT_EQ(verdicts_[1].part, 7);
  EXPECT_EQ(verdicts_[1].verdict, fsmsg::verdict_t::VERDICT_OK);
}

TEST_F(ReportServiceTest, ALostSliceIsNotInspectedSoonAfterTheLoss) {
  SimBus& doomed = network_.AddNode();
  auto sender = std::make_unique<StreamHub>(doomed, "registration");
  sender->Advertise(kRegisteredCloud);
  network_.RunFor(kSecondUs);
  cloud_.points.assign(140'000, {1, 2, 3});  // more than one slice holds
  cloud_.normals.assign(cloud_.size(), {0, 0, 1});
  cloud_.sigma_mm.assign(cloud_.size(), 0.02F);
  cloud_.view.assign(cloud_.size(), 0);
  const auto slices = SliceCloud(cloud_, Fusion(9).utime, 9, kAllViews);
  ASSERT_TRUE(slices.ok());
  ASSERT_GE(slices->size(), 2u);
  for (const auto& slice : *slices) {
    const double loss = slice.slice == 0 ? 1.0 : 0.0;
    network_.SetFaults({.loss = loss, .large_loss = loss});
    ASSERT_TRUE(sender->Publish(kRegisteredCloud, slice).ok());
    network_.RunFor(1000);
  }
  sender.reset();  // nobody left to ask
  network_.RemoveNode(doomed);
  ASSERT_TRUE(line_.Publish(kFusionResult, Fusion(9)).ok());
  SendRegistration(9, fsmsg::registration_t::STATUS_CONVERGED);
  network_.RunFor(20 * kSecondUs);
  ASSERT_EQ(verdicts_.size(), 1u) << "long before the part's timeout";
  EXPECT_EQ(verdicts_[0].verdict, fsmsg::verdict_t::VERDICT_NOT_INSPECTED);
  EXPECT_EQ(verdicts_[0].reason, "The registered points did not arrive whole.");
}

TEST_F(ReportServiceTest, AnEmptyCloudIsNotInspectedAndANumberMayComeAgain) {
  const PointCloud whole = cloud_;
  cloud_ = PointCloud{};
  SendGood(1);
  network_.RunFor(kSecondUs);
  ASSERT_EQ(verdicts_.size(), 1u);
  EXPECT_EQ(verdicts_[0].verdict, fsmsg::verdict_t::VERDICT_NOT_INSPECTED);
  EXPECT_EQ(verdicts_[0].reason, "the cloud is empty");
  cloud_ = whole;
  fsmsg::part_arrived_t again{};
  again.utime = Registration(1, 0).utime + kSecondUs;
  again.part = 1;
  ASSERT_TRUE(line_.Publish(kPartArrived, again).ok());
  ASSERT_TRUE(line_.Publish(kFusionResult, Fusion(2)).ok());  // another part
  network_.RunFor(static_cast<std::int64_t>(config_.part_timeout_s + 5.0) * kSecondUs);
  EXPECT_EQ(verdicts_.size(), 3u) << "part 1, part 1 again, part 2";
}

TEST_F(ReportServiceTest, ResultsThatCannotBeWrittenDoNotKeepTheVerdictFromTheLine) {
  std::ofstream(folder_ / ReportFolderName(1, Registration(1, 0).utime))
      << "a file where the folder should be";
  SendGood(1);
  network_.RunFor(3 * kSecondUs);
  ASSERT_EQ(verdicts_.size(), 1u);
  EXPECT_EQ(verdicts_[0].verdict, fsmsg::verdict_t::VERDICT_OK);
  EXPECT_NE(monitor_.last_error(), "");
}

TEST_F(ReportServiceTest, ARestartKeepsTheHistoryAndWritesThePagesThatAreDue) {
  SendGood(1);
  network_.RunUntilTrue([this] { return !verdicts_.empty(); }, kSecondUs);
  service_.reset();
  EXPECT_TRUE(std::filesystem::exists(folder_ / verdicts_.at(0).report_folder / "report.html"));
  const Result<History> history = History::Open((folder_ / "history.sqlite").string());
  ASSERT_TRUE(history.ok());
  EXPECT_EQ(history->LastValues("total length", 25)->size(), 1u);
}

TEST_F(ReportServiceTest, APartInWorkIsNotInspectedWhenTheServiceStops) {
  Arrive(1);
  SendCloud(1);
  SendRegistration(1, fsmsg::registration_t::STATUS_CONVERGED);
  network_.RunFor(kSecondUs);
  EXPECT_TRUE(verdicts_.empty());
  monitor_.SetState(ServiceState::kStopping, "stopping");
  network_.RunFor(1000);
  service_.reset();
  ASSERT_TRUE(network_.RunUntilTrue([this] { return !verdicts_.empty(); }, 1000));
  EXPECT_EQ(verdicts_[0].verdict, fsmsg::verdict_t::VERDICT_NOT_INSPECTED);
  EXPECT_EQ(verdicts_[0].reason, "The service was stopped before the part was judged.");
  EXPECT_EQ(ReadJson(verdicts_[0])["verdict"], "NOT_INSPECTED");
  EXPECT_TRUE(std::filesystem::exists(folder_ / verdicts_[0].report_folder / "report.html"));
  EXPECT_EQ(monitor_.state(), ServiceState::kStopping);
}

TEST(ReportConfig, RefusesWhatIsWrong) {
  const auto load = [](const char* text) {
    const Result<ConfigFile> file = ConfigFile::Parse(text, "station.toml");
    return ReportConfig::Load(file.value().Table("report"));
  };
  ASSERT_TRUE(load("").ok());
  EXPECT_EQ(load("[report]\ntrend_parts = 30\n[report.uncertainty]\nview_shift_mm = 0.05")->trend_parts, 30);
  EXPECT_EQ(load("[report.uncertainty]\nview_shift_mm = 0.05")->uncertainty.view_shift_mm, 0.05);
  EXPECT_EQ(load("[report.dimensions]\nmax_form_sigma_mm = 0.2")->dimensions.fit.max_form_sigma_mm, 0.2);
  EXPECT_FALSE(load("[report.dimensions]\nmax_form_sigma_mm = 0.0").ok());
  EXPECT_FALSE(load("[report.dimensions]\nmax_form_sigma = 0.2").ok());
  EXPECT_FALSE(load("[report]\ntrend_parts = 2").ok());
  EXPECT_FALSE(load("[report]\npart_timout_s = 60.0").ok());
  EXPECT_FALSE(load("[report]\npart_timeout_s = 1.0\nloss_settle_s = 2.0").ok());
  EXPECT_FALSE(load("[report.uncertainty]\nview_shift_mm = nan").ok());
}

}  // namespace
}  // namespace forgescan
