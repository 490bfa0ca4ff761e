// A report service that is killed and started again: every part still ends with exactly one verdict, and the
// line hears it.
#include <gmock/gmock.h>

#include "services/report/report_service.h"
#include "tests/services/report/report_service_fixture.h"

namespace forgescan {
namespace {

using ::testing::HasSubstr;

class ReportRestartTest : public ReportServiceTest {
 protected:
  ReportRestartTest() : ReportServiceTest({}) { StartAgain(); }
  ~ReportRestartTest() override {
    service_.reset();
    process_.reset();
  }
  // As SIGKILL does: nothing of what the service does when it ends is heard or kept.
  void Kill() {
    const std::filesystem::path kept = folder_.string() + "-kept";
    std::filesystem::copy_file(Kept(), kept, std::filesystem::copy_options::overwrite_existing);
    network_.SetFaults({.loss = 1.0, .large_loss = 1.0});
    service_.reset();
    network_.SetFaults({});
    std::filesystem::rename(kept, Kept());
    process_.reset();
    network_.RunFor(kSecondUs);
  }
  void StartAgain() {
    process_ = std::make_unique<Process>(network_);
    const ReportStation station{"test", "0.1.0", "01234567", folder_.string(), {"report"}};
    auto service = ReportService::Create(*process_->hub, *process_->monitor, config_, station, evaluator_);
    ASSERT_TRUE(service.ok()) << service.error().message;
    service_ = *service;
    network_.RunFor(kSecondUs);
  }
  void SayRobot(std::int64_t session, std::int8_t state = fsmsg::service_state_t::STATE_READY) {
    fsmsg::service_state_t word{};
    word.utime = network_.NowUs();
    word.session = session;
    word.name = "robot";
    word.state = state;
    ASSERT_TRUE(PublishState(line_.bus(), kServiceState, word).ok());
    network_.RunFor(kSecondUs);
  }
  void SayScanComplete(int part) {
    fsmsg::scan_complete_t scan{};
    scan.utime = Fusion(part).utime;
    scan.scan_start_utime = Fusion(part).scan_start_utime;
    scan.part = part;
    ASSERT_TRUE(line_.Publish(kScanComplete, scan).ok());
  }
  void SaySorted(int part) {
    fsmsg::part_sorted_t sorted{};
    sorted.part = part;
    sorted.acknowledged = 1;
    ASSERT_TRUE(line_.Publish(kPartSorted, sorted).ok());
    network_.RunFor(kSecondUs);
  }
  std::filesystem::path Kept() const { return folder_ / "parts_in_work.txt"; }

  struct Process {
    explicit Process(SimNetwork& from) : network(from) {}
    ~Process() {
      monitor.reset();
      hub.reset();
      network.RemoveNode(bus);
    }
    SimNetwork& network;
    SimBus& bus = network.AddNode();
    std::unique_ptr<StreamHub> hub = std::make_unique<StreamHub>(bus, "report");
    std::unique_ptr<ServiceMonitor> monitor = std::make_unique<ServiceMonitor>(*hub, "report", "");
  };
  std::unique_ptr<Process> process_;
};

TEST_F(ReportRestartTest, APartThatIsStillScannedIsJudgedAsIfNothingHadHappened) {
  Arrive(3);
  network_.RunFor(kSecondUs);
  Kill();
  StartAgain();
  EXPECT_EQ(process_->monitor->state(), ServiceState::kWorking);
  SayScanComplete(3);
  ASSERT_TRUE(line_.Publish(kFusionResult, Fusion(3)).ok());
  SendCloud(3);
  SendRegistration(3, fsmsg::registration_t::STATUS_CONVERGED);
  network_.RunFor(3 * kSecondUs);
  ASSERT_EQ(verdicts_.size(), 1u);
  EXPECT_EQ(verdicts_[0].verdict, fsmsg::verdict_t::VERDICT_OK) << verdicts_[0].reason;
}

TEST_F(ReportRestartTest, ResultsTakenInByTheDeadMakeAPartNotInspected) {
  Arrive(3);
  ASSERT_TRUE(line_.Publish(kFusionResult, Fusion(3)).ok());
  network_.RunFor(kSecondUs);
  Kill();
  StartAgain();
  ASSERT_EQ(verdicts_.size(), 1u);
  EXPECT_EQ(verdicts_[0].verdict, fsmsg::verdict_t::VERDICT_NOT_INSPECTED);
  EXPECT_THAT(verdicts_[0].reason, HasSubstr("started again while the part was in work"));
  EXPECT_EQ(ReadJson(verdicts_[0])["verdict"], "NOT_INSPECTED");
  SendCloud(3);
  SendRegistration(3, fsmsg::registration_t::STATUS_CONVERGED);  // too late
  network_.RunFor(2 * static_cast<std::int64_t>(config_.part_timeout_s) * kSecondUs);
  EXPECT_EQ(verdicts_.size(), 1u);
  SendGood(9);
  network_.RunFor(3 * kSecondUs);
  EXPECT_EQ(verdicts_.size(), 2u) << "works again";
  EXPECT_EQ(verdicts_[1].verdict, fsmsg::verdict_t::VERDICT_OK);
}

TEST_F(ReportRestartTest, ResultsThatCameWhileNobodyListenedAreNotWaitedForLong) {
  Arrive(3);
  network_.RunFor(kSecondUs);
  Kill();
  ASSERT_TRUE(line_.Publish(kFusionResult, Fusion(3)).ok());
  SendCloud(3);
  network_.RunFor(kSecondUs);
  StartAgain();
  SendRegistration(3, fsmsg::registration_t::STATUS_CONVERGED);
  network_.RunFor(10 * kSecondUs);
  ASSERT_EQ(verdicts_.size(), 1u);
  EXPECT_EQ(verdicts_[0].verdict, fsmsg::verdict_t::VERDICT_NOT_INSPECTED);
  EXPECT_THAT(verdicts_[0].reason, HasSubstr("did not arrive whole"));
}

TEST_F(ReportRestartTest, APartThatNothingComesOfAnyMoreTimesOut) {
  Arrive(3);
  network_.RunFor(kSecondUs);
  Kill();
  StartAgain();
  network_.RunFor(static_cast<std::int64_t>(config_.part_timeout_s + 5) * kSecondUs);
  ASSERT_EQ(verdicts_.size(), 1u);
  EXPECT_EQ(verdicts_[0].verdict, fsmsg::verdict_t::VERDICT_NOT_INSPECTED);
}

TEST_F(ReportRestartTest, ARobotStartedAgainHearsTheVerdictsTheLineHasNotAnswered) {
  SayRobot(1);
  SendGood(3);
  network_.RunFor(3 * kSecondUs);
  SaySorted(3);
  SendGood(4);
  network_.RunFor(3 * kSecondUs);
  ASSERT_EQ(verdicts_.size(), 2u);
  SayRobot(1);
  EXPECT_EQ(verdicts_.size(), 2u) << "the same robot service";
  SayRobot(2, fsmsg::service_state_t::STATE_STARTING);
  EXPECT_EQ(verdicts_.size(), 2u) << "it does not listen yet";
  SayRobot(2);
  ASSERT_EQ(verdicts_.size(), 3u);
  EXPECT_EQ(verdicts_[2].part, 4);
  EXPECT_EQ(verdicts_[2].utime, verdicts_[1].utime);
  EXPECT_EQ(verdicts_[2].report_folder, verdicts_[1].report_folder);
}

TEST_F(ReportRestartTest, AVerdictSurvivesTheReportToo) {
  SendGood(4);
  network_.RunFor(3 * kSecondUs);
  ASSERT_EQ(verdicts_.size(), 1u);
  Kill();
  StartAgain();
  SayRobot(7);
  ASSERT_EQ(verdicts_.size(), 2u);
  EXPECT_EQ(verdicts_[1].verdict, fsmsg::verdict_t::VERDICT_OK);
  EXPECT_EQ(verdicts_[1].dimension_count, 1);
  EXPECT_EQ(verdicts_[1].dimensions.at(0).measured_mm, verdicts_[0].dimensions.at(0).measured_mm);
  SaySorted(4);
  Kill();
  StartAgain();
  SayRobot(8);
  EXPECT_EQ(verdicts_.size(), 2u) << "the line has answered";
}

TEST_F(ReportRestartTest, ADamagedFileIsNamedAndTheServiceWorks) {
  Arrive(3);
  network_.RunFor(kSecondUs);
  Kill();
  for (const char* wrong : {"3\n", "3 17 - 0 zz\n", "3 17 - 0 0123\n", "3 17 x 0 -\n", "3 17 - 0 - more\n"}) {
    std::ofstream(Kept()) << wrong;
    KeptParts kept(Kept().string());
    const Status recalled = kept.Recall();
    ASSERT_FALSE(recalled.ok()) << wrong;
    EXPECT_THAT(recalled.error().message, HasSubstr("is no part"));
  }
  StartAgain();
  EXPECT_THAT(process_->monitor->last_error(), HasSubstr("is no part"));
  SendGood(9);
  network_.RunFor(3 * kSecondUs);
  EXPECT_EQ(verdicts_.size(), 1u);
}

}  // namespace
}  // namespace forgescan
