// The fusion service of a station with standing surfaces.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "services/common/bus/channels.h"
#include "services/common/bus/sim_bus.h"
#include "services/fusion/fusion_service.h"
#include "tests/services/fusion/standing_scene.h"

namespace forgescan {
namespace {

using testing::AtLeast;
using testing::Corner;
using ::testing::HasSubstr;
using testing::kMiddle;
using testing::Motion;
using testing::Moved;
using testing::Robot;

constexpr std::int64_t kSecondUs = 1'000'000;
constexpr std::int64_t kViewUtime = 1000;

// A station of one view.
class StandingCorrectionTest : public ::testing::Test {
 protected:
  StandingCorrectionTest() {
    FusionConfig config;
    config.expansion_degc = {860, 1200};
    config.expansion = {0.011, 0.0178};
    ViewMatrices matrices;
    matrices.array_from_camera.assign(1, Eigen::Isometry3d::Identity());
    const Eigen::AlignedBox3d everywhere(Eigen::Vector3d::Constant(-5000), Eigen::Vector3d::Constant(5000));
    const std::vector<std::vector<ViewCloud>> scans{{{0, 20, Corner(1), {}}}};
    auto standing = MakeStandingSurfaces(scans, {{}, matrices, {&everywhere, 1}, Robot()});
    service_ = std::make_unique<FusionService>(
        hub_, monitor_, config,
        FusionFiles{matrices, *ExpansionCurve::Create(config.expansion_degc, config.expansion),
                    VisitCorrection(std::move(*standing), AtLeast(100))});
    listener_.Subscribe<fsmsg::fusion_result_t>(kFusionResult,
                                                [this](const auto& result) { results_.push_back(result); });
    listener_.Subscribe<fsmsg::cloud_slice_t>(kFusedCloud, [this](const auto& slice) {
      if (auto cloud = assembler_.Add(slice); cloud.ok() && cloud->has_value()) {
        clouds_.push_back(std::move(**cloud));
      }
    });
    network_.RunFor(kSecondUs);
  }

  // A whole part of one view that shows this.
  void Inspect(int part, PointCloud cloud) {
    cloud.view.assign(cloud.size(), 0);
    fsmsg::part_arrived_t arrived{};
    arrived.part = part;
    ASSERT_TRUE(sender_.Publish(kPartArrived, arrived).ok());
    for (const auto& slice : *SliceCloud(cloud, kViewUtime, part, 0)) {
      ASSERT_TRUE(sender_.Publish(kViewCloud, slice).ok());
    }
    fsmsg::view_result_t result{};
    result.utime = kViewUtime;
    result.part = part;
    result.status = fsmsg::view_result_t::STATUS_OK;
    result.points = static_cast<std::int32_t>(cloud.size());
    ASSERT_TRUE(sender_.Publish(kViewResult, result).ok());
    fsmsg::part_temperature_t temperature{};
    temperature.part = part;
    temperature.valid = 1;
    temperature.temperature_degc = 900;
    ASSERT_TRUE(sender_.Publish(kPartTemperature, temperature).ok());
    fsmsg::scan_complete_t scan{};
    scan.part = part;
    scan.status = fsmsg::scan_complete_t::STATUS_COMPLETE;
    scan.views_expected = scan.views_captured = 1;
    scan.utime = 2 * kViewUtime;
    ASSERT_TRUE(sender_.Publish(kScanComplete, scan).ok());
    network_.RunFor(kSecondUs);
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

TEST_F(StandingCorrectionTest, FusesTheViewWhereItWasTaught) {
  const Eigen::Isometry3d taught_from_actual = Motion({0.01, 0.006, -0.008}, {3e-5, 0, -2e-5});
  const PointCloud seen = Moved(Corner(2), taught_from_actual.inverse());
  Inspect(1, seen);
  ASSERT_EQ(results_.size(), 1U);
  EXPECT_EQ(results_[0].status, fsmsg::view_result_t::STATUS_OK);
  ASSERT_EQ(clouds_.size(), 1U);
  double worst_mm = 0;
  for (std::size_t i = 0; i < seen.size(); ++i) {
    const Eigen::Vector3d true_place = taught_from_actual * seen.points[i].cast<double>();
    worst_mm = std::max(worst_mm, (clouds_[0].points[i].cast<double>() - true_place).norm());
  }
  EXPECT_LT(worst_mm, 0.004);  // of 0.014: the estimate's own noise 100 mm from the middle
  EXPECT_EQ(monitor_.counter("views_corrected"), 1);
  EXPECT_NEAR(static_cast<double>(monitor_.counter("last_view_shift_um")), 14, 3);
  EXPECT_GT(monitor_.counter("last_view_cells"), 3000);
}

TEST_F(StandingCorrectionTest, AKnockVoidsTheViewAndTheNextPartIsFused) {
  Inspect(1, Moved(Corner(2), Motion({0.08, 0, 0}, {0, 0, 0})));
  ASSERT_EQ(results_.size(), 1U);
  EXPECT_EQ(results_[0].status, fsmsg::view_result_t::STATUS_VOID);
  EXPECT_THAT(results_[0].views.at(0).reason, HasSubstr("a knock, or what stood still was moved"));
  EXPECT_THAT(monitor_.last_error(), HasSubstr("part 1"));
  EXPECT_EQ(monitor_.counter("views_knocked"), 1);
  Inspect(2, Corner(3));
  ASSERT_EQ(results_.size(), 2U);
  EXPECT_EQ(results_[1].status, fsmsg::view_result_t::STATUS_OK);
}

TEST_F(StandingCorrectionTest, AViewThatShowsTooLittleKeepsTheRobotsErrorAndIsCounted) {
  PointCloud part;
  std::mt19937 random(4);
  testing::AddSquare(kMiddle - Eigen::Vector3d(0, 0, 60), Eigen::Vector3d(0, 0.8, -0.6), random, part);
  Inspect(1, part);
  ASSERT_EQ(clouds_.size(), 1U);
  EXPECT_EQ(clouds_[0].points, part.points);
  EXPECT_EQ(monitor_.counter("views_uncorrected"), 1);
  EXPECT_EQ(monitor_.counter("views_corrected"), 0);
}

}  // namespace
}  // namespace forgescan
