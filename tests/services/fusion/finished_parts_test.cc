// What comes of a part after its result, and views taken with a robot of another temperature than at the
// teaching.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "services/common/bus/channels.h"
#include "services/common/bus/sim_bus.h"
#include "services/fusion/fusion_service.h"

namespace forgescan {
namespace {

using ::testing::HasSubstr;

constexpr std::int64_t kSecondUs = 1'000'000;
constexpr std::uint32_t kPathCrc = 7;

// A station of one view.
class FinishedPartsTest : public ::testing::Test {
 protected:
  void Start(bool body_change_voids = false) {
    FusionConfig config;
    config.expansion_degc = {860, 1200};
    config.expansion = {0.011, 0.0178};
    config.body_change_voids = body_change_voids;
    ViewMatrices matrices;
    matrices.path_crc32 = kPathCrc;
    matrices.recorded_body_degc = 35;
    matrices.array_from_camera.assign(1, Eigen::Isometry3d::Identity());
    service_ = std::make_unique<FusionService>(
        hub_, monitor_, config,
        FusionFiles{matrices, *ExpansionCurve::Create(config.expansion_degc, config.expansion), {}});
    listener_.Subscribe<fsmsg::fusion_result_t>(kFusionResult,
                                                [this](const auto& result) { results_.push_back(result); });
    network_.RunFor(kSecondUs);
  }
  template <typename Message>
  Message Of(int part) const {
    Message message{};
    message.part = part;
    message.utime = network_.NowUs() + step_us_;
    return message;
  }
  void Arrive(int part) {
    auto arrived = Of<fsmsg::part_arrived_t>(part);
    arrived.view_count = 1;
    arrived.path_crc32 = static_cast<std::int32_t>(kPathCrc);
    ASSERT_TRUE(sender_.Publish(kPartArrived, arrived).ok());
    network_.RunFor(kSecondUs);
  }
  void Ready(int part, double body_degc) {
    auto ready = Of<fsmsg::view_ready_t>(part);
    ready.robot_body_degc = body_degc;
    ASSERT_TRUE(sender_.Publish(kViewReady, ready).ok());
    network_.RunFor(kSecondUs);
  }
  void View(int part) {
    auto temperature = Of<fsmsg::part_temperature_t>(part);
    temperature.valid = 1;
    temperature.temperature_degc = 900;
    ASSERT_TRUE(sender_.Publish(kPartTemperature, temperature).ok());
    PointCloud cloud;
    cloud.points.assign(5, Eigen::Vector3f(1, 2, 3));
    cloud.normals.assign(5, Eigen::Vector3f::UnitZ());
    cloud.sigma_mm.assign(5, 0.01F);
    cloud.view.assign(5, 0);
    for (const auto& slice : *SliceCloud(cloud, network_.NowUs() + step_us_, part, 0)) {
      ASSERT_TRUE(sender_.Publish(kViewCloud, slice).ok());
    }
    auto result = Of<fsmsg::view_result_t>(part);
    result.status = fsmsg::view_result_t::STATUS_OK;
    result.points = 5;
    ASSERT_TRUE(sender_.Publish(kViewResult, result).ok());
    network_.RunFor(kSecondUs);
  }
  void End(int part) {
    auto scan = Of<fsmsg::scan_complete_t>(part);
    scan.status = fsmsg::scan_complete_t::STATUS_COMPLETE;
    scan.views_expected = scan.views_captured = 1;
    ASSERT_TRUE(sender_.Publish(kScanComplete, scan).ok());
    network_.RunFor(kSecondUs);
  }
  void Part(int part, double body_degc = 35) {
    Arrive(part);
    Ready(part, body_degc);
    View(part);
    End(part);
  }

  std::int64_t step_us_ = 0;  // of the clock the messages are stamped by
  SimNetwork network_;
  StreamHub hub_{network_.AddNode(), "fusion"};
  StreamHub sender_{network_.AddNode(), "sender"};
  StreamHub listener_{network_.AddNode(), "listener"};
  ServiceMonitor monitor_{hub_, "fusion", ""};
  std::unique_ptr<FusionService> service_;
  std::vector<fsmsg::fusion_result_t> results_;
};

TEST_F(FinishedPartsTest, LateMessagesMakeNoSecondPart) {
  Start();
  Part(1);
  ASSERT_EQ(results_.size(), 1U);
  step_us_ = -2 * kSecondUs;  // of the scan that has its result
  View(1);
  End(1);
  network_.RunFor(200 * kSecondUs);  // longer than the timeout of a part
  EXPECT_EQ(results_.size(), 1U);
  EXPECT_GE(monitor_.counter("messages_late"), 4);
}

TEST_F(FinishedPartsTest, TheSameNumberThatArrivesAgainIsAnotherPart) {
  Start();
  for (std::size_t i = 1; i <= 3; ++i) {
    Part(1);
    ASSERT_EQ(results_.size(), i);
    EXPECT_EQ(results_.back().status, fsmsg::view_result_t::STATUS_OK);
  }
}

TEST_F(FinishedPartsTest, APartWhoseArrivalWasLostAfterAFinishedOneHasItsResult) {
  Start();
  Part(1);
  network_.RunFor(45 * kSecondUs);
  View(1);
  End(1);
  network_.RunFor(70 * kSecondUs);  // longer than the timeout of a view
  ASSERT_EQ(results_.size(), 2U);
  EXPECT_EQ(results_[1].status, fsmsg::view_result_t::STATUS_VOID);
  EXPECT_THAT(results_[1].reason, HasSubstr("arrival was not seen"));
  EXPECT_NE(results_[1].utime, results_[0].utime);
}

TEST_F(FinishedPartsTest, ViewsOfTwoPartsAreNotJoinedWhenTheArrivalBetweenThemWasLost) {
  Start();
  Arrive(1);
  End(1);  // and its view is late
  network_.RunFor(45 * kSecondUs);
  View(1);
  End(1);
  network_.RunFor(70 * kSecondUs);
  ASSERT_EQ(results_.size(), 1U);
  EXPECT_EQ(results_[0].status, fsmsg::view_result_t::STATUS_VOID);
  EXPECT_THAT(monitor_.last_error(), HasSubstr("arrival was not seen"));
}

// Of a scan that was broken off while the view was exposed.
TEST_F(FinishedPartsTest, AViewThatEndsSoonAfterItsScanBeginsNoPart) {
  Start();
  Part(1);
  ASSERT_EQ(results_.size(), 1U);
  step_us_ = kSecondUs / 2;
  View(1);
  EXPECT_EQ(monitor_.counter("messages_late"), 3);
}

TEST_F(FinishedPartsTest, TheDurationCarriesTheTimeOfItsResult) {
  std::vector<fsmsg::processing_time_t> times;
  listener_.Subscribe<fsmsg::processing_time_t>(kFusionTime,
                                                [&times](const auto& time) { times.push_back(time); });
  Start();
  Part(1);
  ASSERT_EQ(results_.size(), 1U);
  ASSERT_EQ(times.size(), 1U);
  EXPECT_EQ(times[0].utime, results_[0].utime);
}

TEST_F(FinishedPartsTest, AClockSetBackMakesNoDifferenceToThat) {
  Start();
  Part(1);
  step_us_ = -3600 * kSecondUs;
  Part(1);
  ASSERT_EQ(results_.size(), 2U);
  EXPECT_EQ(results_.back().status, fsmsg::view_result_t::STATUS_OK);
}

TEST_F(FinishedPartsTest, AnUnfinishedPartLeavesNothingToTheNextWithItsNumber) {
  Start();
  Arrive(1);
  View(1);
  Arrive(1);  // the line was started anew
  End(1);
  EXPECT_TRUE(results_.empty()) << "the view of the earlier part is not this one's";
  View(1);
  ASSERT_EQ(results_.size(), 1U);
  EXPECT_EQ(results_[0].status, fsmsg::view_result_t::STATUS_OK);
  EXPECT_THAT(monitor_.last_error(), HasSubstr("part 1 never finished"));
}

TEST_F(FinishedPartsTest, NewsOfTheEarlierPartAreNotTheNextOnes) {
  Start();
  Arrive(1);
  network_.RunFor(30 * kSecondUs);
  Arrive(1);
  step_us_ = -10 * kSecondUs;  // taken while the earlier one was in place
  View(1);
  End(1);
  EXPECT_EQ(monitor_.counter("messages_late"), 4);
  step_us_ = 0;
  View(1);
  End(1);
  ASSERT_EQ(results_.size(), 1U);
  EXPECT_EQ(results_[0].utime, network_.NowUs() - kSecondUs);
}

TEST_F(FinishedPartsTest, AnEarlierPartWhoseArrivalWasNotSeenIsDroppedToo) {
  Start();
  View(1);
  Part(1);
  ASSERT_EQ(results_.size(), 1U);
  EXPECT_EQ(results_[0].status, fsmsg::view_result_t::STATUS_OK);
  EXPECT_THAT(monitor_.last_error(), HasSubstr("part 1 never finished"));
}

TEST_F(FinishedPartsTest, ABodyThatIsNotAsWarmAsAtTheTeachingIsNamed) {
  Start();
  Part(1, 39.9);
  EXPECT_EQ(monitor_.counter("views_off_temperature"), 0);
  Part(2, 40.1);
  Part(3, std::nan(""));
  EXPECT_EQ(monitor_.counter("views_off_temperature"), 2);
  ASSERT_EQ(results_.size(), 3U);
  EXPECT_EQ(results_[2].status, fsmsg::view_result_t::STATUS_OK);
}

TEST_F(FinishedPartsTest, AndItsViewsAreVoidIfTheStationSaysSo) {
  Start(true);
  Part(1, 28);
  ASSERT_EQ(results_.size(), 1U);
  EXPECT_EQ(results_[0].status, fsmsg::view_result_t::STATUS_VOID);
  EXPECT_THAT(results_[0].reason, HasSubstr("28.0 degC"));
  Part(2, 36);
  EXPECT_EQ(results_.back().status, fsmsg::view_result_t::STATUS_OK);
}

}  // namespace
}  // namespace forgescan
