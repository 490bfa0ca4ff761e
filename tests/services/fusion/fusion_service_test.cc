#include "services/fusion/fusion_service.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "services/common/bus/channels.h"
#include "services/common/bus/sim_bus.h"

namespace forgescan {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

constexpr std::uint32_t kPathCrc = 0xfedcba98;
constexpr std::int64_t kSecondUs = 1'000'000;
constexpr std::int64_t kViewUtime = 1;

// The fusion service of a two-view station, and the senders around it.
class FusionServiceTest : public ::testing::Test {
 protected:
  FusionServiceTest() {
    FusionConfig config;
    config.expansion_degc = {860, 1200};
    config.expansion = {0.011, 0.0178};
    ViewMatrices matrices;
    matrices.path_crc32 = kPathCrc;
    matrices.array_from_camera.assign(2, Eigen::Isometry3d::Identity());
    service_ = std::make_unique<FusionService>(
        hub_, monitor_, config,
        FusionFiles{matrices, *ExpansionCurve::Create(config.expansion_degc, config.expansion), {}});
    listener_.Subscribe<fsmsg::fusion_result_t>(kFusionResult,
                                                [this](const auto& result) { results_.push_back(result); });
    listener_.Subscribe<fsmsg::cloud_slice_t>(kFusedCloud, [this](const auto& slice) {
      if (auto cloud = assembler_.Add(slice); cloud.ok() && cloud->has_value()) {
        clouds_.push_back(std::move(**cloud));
      }
    });
    network_.RunFor(kSecondUs);
  }

  void Arrive(int part, std::uint32_t crc = kPathCrc) {
    fsmsg::part_arrived_t arrived{};
    arrived.part = part;
    arrived.view_count = 2;
    arrived.path_crc32 = static_cast<std::int32_t>(crc);
    ASSERT_TRUE(sender_.Publish(kPartArrived, arrived).ok());
  }
  void Cloud(int part, int view, std::size_t points) {
    Slices(part, view, points, kViewUtime);
    Result(part, view, points, kViewUtime);
  }
  void Slices(int part, int view, std::size_t points, std::int64_t utime) {
    PointCloud cloud;
    cloud.points.assign(points, Eigen::Vector3f(1, 2, 3));
    cloud.normals.assign(points, Eigen::Vector3f::UnitZ());
    cloud.sigma_mm.assign(points, 0.01F);
    cloud.view.assign(points, static_cast<std::uint16_t>(view));
    for (const auto& slice : *SliceCloud(cloud, utime, part, view)) {
      ASSERT_TRUE(sender_.Publish(kViewCloud, slice).ok());
    }
  }
  void Result(int part, int view, std::size_t points, std::int64_t utime) {
    fsmsg::view_result_t result{};
    result.utime = utime;
    result.part = part;
    result.view = view;
    result.status = fsmsg::view_result_t::STATUS_OK;
    result.points = static_cast<std::int32_t>(points);
    result.frames_expected = result.frames_used = 16;
    ASSERT_TRUE(sender_.Publish(kViewResult, result).ok());
  }
  void Temperature(int part, int view, double degc, bool valid = true) {
    fsmsg::part_temperature_t temperature{};
    temperature.part = part;
    temperature.view = view;
    temperature.valid = valid ? 1 : 0;
    temperature.temperature_degc = degc;
    ASSERT_TRUE(sender_.Publish(kPartTemperature, temperature).ok());
  }
  void ScanComplete(int part, int captured = 2, const std::string& reason = "") {
    fsmsg::scan_complete_t scan{};
    scan.part = part;
    scan.status =
        reason.empty() ? fsmsg::scan_complete_t::STATUS_COMPLETE : fsmsg::scan_complete_t::STATUS_ABORTED;
    scan.views_expected = 2;
    scan.views_captured = captured;
    scan.reason = reason;
    scan.utime = 4242;
    ASSERT_TRUE(sender_.Publish(kScanComplete, scan).ok());
  }
  void WholePart(int part) {
    Arrive(part);
    for (int view = 0; view < 2; ++view) {
      Cloud(part, view, 5);
      Temperature(part, view, 900);
    }
    ScanComplete(part);
  }

  SimNetwork network_;
  StreamHub hub_{network_.AddNode(), "fusion"};
  StreamHub sender_{network_.AddNode(), "sender"};
  StreamHub listener_{network_.AddNode(), "listener"};
  ServiceMonitor monitor_{hub_, "fusion", ""};
  std::unique_ptr<FusionService> service_;
  CloudAssembler assembler_;
  std::vector<fsmsg::fusion_result_t> results_;
  std::vector<PointCloud> clouds_;
};

TEST_F(FusionServiceTest, Starts) { EXPECT_EQ(monitor_.state(), ServiceState::kReady); }

TEST_F(FusionServiceTest, FusesAWholePart) {
  WholePart(3);
  network_.RunFor(kSecondUs);
  ASSERT_EQ(results_.size(), 1u);
  EXPECT_EQ(results_[0].part, 3);
  EXPECT_EQ(results_[0].status, fsmsg::view_result_t::STATUS_OK);
  EXPECT_EQ(results_[0].points, 10);
  EXPECT_EQ(results_[0].frames_used, 32);
  EXPECT_EQ(results_[0].utime, 4242);
  EXPECT_EQ(results_[0].views.at(1).scale, 1.0);
  ASSERT_EQ(clouds_.size(), 1u);
  EXPECT_EQ(clouds_[0].view, (std::vector<std::uint16_t>{0, 0, 0, 0, 0, 1, 1, 1, 1, 1}));
}

TEST_F(FusionServiceTest, TheEndMayComeBeforeTheClouds) {
  Arrive(1);
  ScanComplete(1);
  Temperature(1, 1, 900);
  Temperature(1, 0, 900);
  Cloud(1, 1, 5);
  network_.RunFor(kSecondUs);
  EXPECT_TRUE(results_.empty());
  Cloud(1, 0, 5);
  network_.RunFor(kSecondUs);
  ASSERT_EQ(results_.size(), 1u);
  EXPECT_EQ(results_[0].status, fsmsg::view_result_t::STATUS_OK);
}

TEST_F(FusionServiceTest, TwoPartsMayInterleave) {
  Arrive(1);
  Cloud(1, 0, 5);
  WholePart(2);
  network_.RunFor(kSecondUs);
  ASSERT_EQ(results_.size(), 1u);
  EXPECT_EQ(results_[0].part, 2);
  Cloud(1, 1, 7);
  Temperature(1, 0, 900);
  Temperature(1, 1, 900);
  ScanComplete(1);
  network_.RunFor(kSecondUs);
  ASSERT_EQ(results_.size(), 2u);
  EXPECT_EQ(results_[1].points, 12);
}

TEST_F(FusionServiceTest, ALateViewIsNamedAndThePartIsVoid) {
  Arrive(1);
  Cloud(1, 0, 5);
  Temperature(1, 0, 900);
  Temperature(1, 1, 900);
  ScanComplete(1);
  network_.RunFor(61 * kSecondUs);
  ASSERT_EQ(results_.size(), 1u);
  EXPECT_EQ(results_[0].status, fsmsg::view_result_t::STATUS_VOID);
  EXPECT_THAT(results_[0].reason, AllOf(HasSubstr("view 1"), HasSubstr("within 60 s")));
  EXPECT_TRUE(clouds_.empty());
  WholePart(2);  // and it still works
  network_.RunFor(kSecondUs);
  ASSERT_EQ(results_.size(), 2u);
  EXPECT_EQ(results_[1].status, fsmsg::view_result_t::STATUS_OK);
}

TEST_F(FusionServiceTest, ACloudOfAnotherAttemptIsNotTheResultsOwn) {
  Arrive(1);
  Cloud(1, 0, 5);
  Slices(1, 1, 5, kViewUtime);
  Result(1, 1, 5, kViewUtime + 1);  // as many points, but of the next attempt
  Temperature(1, 0, 900);
  Temperature(1, 1, 900);
  ScanComplete(1);
  network_.RunFor(kSecondUs);
  EXPECT_TRUE(results_.empty());
  Slices(1, 1, 5, kViewUtime + 1);
  network_.RunFor(kSecondUs);
  ASSERT_EQ(results_.size(), 1u);
  EXPECT_EQ(results_[0].status, fsmsg::view_result_t::STATUS_OK);
}

TEST_F(FusionServiceTest, AnAbortedScanEndsAtOnce) {
  Arrive(1);
  Cloud(1, 0, 5);
  Temperature(1, 0, 900);
  ScanComplete(1, 1, "protective stop");
  network_.RunFor(kSecondUs);
  ASSERT_EQ(results_.size(), 1u);
  EXPECT_THAT(results_[0].reason, AllOf(HasSubstr("view 1"), HasSubstr("protective stop")));
}

TEST_F(FusionServiceTest, WithoutTemperatureTheViewIsVoid) {
  Arrive(1);
  Cloud(1, 0, 5);
  Cloud(1, 1, 5);
  Temperature(1, 0, 900);
  Temperature(1, 1, 0, false);
  ScanComplete(1);
  network_.RunFor(kSecondUs);
  ASSERT_EQ(results_.size(), 1u);
  EXPECT_THAT(results_[0].reason, HasSubstr("pyrometer"));
}

TEST_F(FusionServiceTest, ATemperatureOutsideTheTableIsNoScale) {
  Arrive(1);
  for (int view = 0; view < 2; ++view) {
    Cloud(1, view, 5);
    Temperature(1, view, view == 0 ? 900 : 300);
  }
  ScanComplete(1);
  network_.RunFor(kSecondUs);
  ASSERT_EQ(results_.size(), 1u);
  EXPECT_EQ(results_[0].status, fsmsg::view_result_t::STATUS_VOID);
  EXPECT_THAT(results_[0].reason, HasSubstr("expansion table"));
}

TEST_F(FusionServiceTest, AnotherPathThanTheTaughtOneIsRefused) {
  Arrive(1, kPathCrc + 1);
  for (int view = 0; view < 2; ++view) {
    Cloud(1, view, 5);
    Temperature(1, view, 900);
  }
  ScanComplete(1);
  network_.RunFor(kSecondUs);
  ASSERT_EQ(results_.size(), 1u);
  EXPECT_THAT(results_[0].reason, HasSubstr("taught"));
}

TEST_F(FusionServiceTest, LossOnTheBusChangesNothing) {
  network_.SetFaults({.loss = 0.2, .large_loss = 0.5, .duplicate = 0.2, .jitter_us = 50'000});
  WholePart(1);
  network_.RunFor(20 * kSecondUs);
  ASSERT_EQ(results_.size(), 1u);
  EXPECT_EQ(results_[0].status, fsmsg::view_result_t::STATUS_OK);
  EXPECT_EQ(clouds_.size(), 1u);
}

}  // namespace
}  // namespace forgescan
