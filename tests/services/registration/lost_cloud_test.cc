// A part whose fused cloud cannot become whole ends with a message that says so, in bounded time.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "services/common/bus/channels.h"
#include "services/common/bus/sim_bus.h"
#include "services/registration/registration_service.h"
#include "tests/common/shapes/test_axle.h"

namespace forgescan {
namespace {

using ::testing::HasSubstr;

constexpr std::int64_t kSecondUs = 1'000'000;
constexpr std::int64_t kFirst = 1000, kSecond = 2000;  // ends of two scans

class LostCloudTest : public ::testing::Test {
 protected:
  LostCloudTest() {
    const auto bundle = testing::MakeAxle(testing::AxleSize{}, 16);
    service_ = std::make_unique<RegistrationService>(hub_, monitor_, RegistrationConfig{},
                                                     RegistrationModel::Build(*bundle).value());
    listener_.Subscribe<fsmsg::registration_t>(kRegistration,
                                               [this](const auto& message) { results_.push_back(message); });
    network_.RunFor(kSecondUs);
  }
  void Fused(int part, std::int64_t utime) {
    fsmsg::fusion_result_t result{};
    result.utime = utime;
    result.part = part;
    result.status = fsmsg::view_result_t::STATUS_OK;
    ASSERT_TRUE(fusion_.Publish(kFusionResult, result).ok());
  }
  // Two slices, of which the first `sent` are published.
  void Slices(int part, std::size_t sent, std::int64_t utime) {
    for (std::size_t i = 0; i < sent; ++i) {
      ASSERT_TRUE(fusion_.Publish(kFusedCloud, TwoSlices(part, utime)[i]).ok());
    }
  }
  void SecondSlice(int part, std::int64_t utime) {
    ASSERT_TRUE(fusion_.Publish(kFusedCloud, TwoSlices(part, utime)[1]).ok());
  }
  static std::vector<fsmsg::cloud_slice_t> TwoSlices(int part, std::int64_t utime) {
    constexpr std::size_t kPoints = 150'000;
    PointCloud cloud;
    cloud.points.assign(kPoints, Eigen::Vector3f(1, 2, 3));
    cloud.normals.assign(kPoints, Eigen::Vector3f::UnitZ());
    cloud.sigma_mm.assign(kPoints, 0.01F);
    cloud.view.assign(kPoints, 0);
    return SliceCloud(cloud, utime, part, kAllViews).value();
  }

  SimNetwork network_;
  StreamHub hub_{network_.AddNode(), "registration"};
  StreamHub fusion_{network_.AddNode(), "fusion"};
  StreamHub listener_{network_.AddNode(), "listener"};
  ServiceMonitor monitor_{hub_, "registration", ""};
  std::unique_ptr<RegistrationService> service_;
  std::vector<fsmsg::registration_t> results_;
};

TEST_F(LostCloudTest, HalfACloudFailsAfterItsTimeout) {
  Slices(1, 1, kFirst);
  Fused(1, kFirst);
  network_.RunFor(10 * kSecondUs);
  EXPECT_TRUE(results_.empty());
  network_.RunFor(10 * kSecondUs);  // the timeout is 15 s
  ASSERT_EQ(results_.size(), 1U);
  EXPECT_EQ(results_[0].status, fsmsg::registration_t::STATUS_FAILED);
  EXPECT_THAT(results_[0].reason, HasSubstr("not whole"));
  EXPECT_TRUE(std::isnan(results_[0].model_from_array[0]));
}

TEST_F(LostCloudTest, AWholeCloudIsNotGivenUp) {
  Fused(1, kFirst);
  network_.RunFor(5 * kSecondUs);
  Slices(1, 2, kFirst);
  network_.RunFor(30 * kSecondUs);
  ASSERT_EQ(results_.size(), 1U);  // and fails for what it is: one point, 150 000 times
  EXPECT_THAT(results_[0].reason, ::testing::Not(HasSubstr("not whole")));
}

TEST_F(LostCloudTest, ThePartNumberMayComeAgain) {
  Fused(1, kFirst);
  network_.RunFor(20 * kSecondUs);
  Fused(1, kSecond);
  network_.RunFor(10 * kSecondUs);
  EXPECT_EQ(results_.size(), 1U);
  network_.RunFor(10 * kSecondUs);
  EXPECT_EQ(results_.size(), 2U);
}

TEST_F(LostCloudTest, TheCloudOfAnEarlierPartWithTheNumberIsNotUsed) {
  Slices(1, 2, kFirst);  // and its result never comes
  network_.RunFor(5 * kSecondUs);
  Fused(1, kSecond);
  network_.RunFor(5 * kSecondUs);
  EXPECT_TRUE(results_.empty());
  Slices(1, 2, kSecond);
  network_.RunFor(kSecondUs);
  ASSERT_EQ(results_.size(), 1U);
  EXPECT_EQ(results_[0].utime, kSecond);
  EXPECT_THAT(results_[0].reason, ::testing::Not(HasSubstr("not whole")));
}

TEST_F(LostCloudTest, GivingUpTheEarlierPartLeavesTheLaterItsSlices) {
  Slices(1, 1, kFirst);
  Fused(1, kFirst);
  network_.RunFor(14 * kSecondUs);
  Slices(1, 1, kSecond);
  Fused(1, kSecond);
  network_.RunFor(5 * kSecondUs);
  ASSERT_EQ(results_.size(), 1U);
  EXPECT_EQ(results_[0].utime, kFirst);
  SecondSlice(1, kSecond);
  network_.RunFor(kSecondUs);
  ASSERT_EQ(results_.size(), 2U);
  EXPECT_THAT(results_[1].reason, ::testing::Not(HasSubstr("not whole")));
}

TEST_F(LostCloudTest, APartThatIsDoneTakesNoHoleFromOneThatWaits) {
  const auto doomed =
      std::make_unique<StreamHub>(network_.AddNode(), "fusion",
                                  StreamOptions{.history_bytes = 1, .burst_bytes = 1});  // keeps one message
  doomed->Advertise(kFusedCloud);
  Fused(1, kFirst);
  network_.RunFor(kSecondUs);
  network_.SetFaults({.loss = 1.0, .large_loss = 1.0});
  ASSERT_TRUE(doomed->Publish(kFusedCloud, TwoSlices(1, kFirst)[0]).ok());
  network_.SetFaults({});
  ASSERT_TRUE(doomed->Publish(kFusedCloud, TwoSlices(1, kFirst)[1]).ok());
  network_.RunFor(3 * kSecondUs);
  EXPECT_THAT(monitor_.last_error(), HasSubstr("are lost"));
  Slices(2, 2, kSecond);
  Fused(2, kSecond);
  network_.RunFor(5 * kSecondUs);
  ASSERT_EQ(results_.size(), 1U);
  EXPECT_EQ(results_[0].part, 2);
  Fused(3, kSecond);                // after the hole
  network_.RunFor(20 * kSecondUs);  // longer than the timeouts of parts 1 and 3
  ASSERT_EQ(results_.size(), 3U);
  EXPECT_EQ(results_[1].part, 1);
  EXPECT_THAT(results_[1].reason, HasSubstr("slices 1 to 1 of the fused clouds are lost"));
  EXPECT_EQ(results_[2].part, 3);
  EXPECT_THAT(results_[2].reason, ::testing::Not(HasSubstr("are lost")));
}

TEST_F(LostCloudTest, TheDurationCarriesTheTimeOfItsResult) {
  std::vector<fsmsg::processing_time_t> times;
  listener_.Subscribe<fsmsg::processing_time_t>(kRegistrationTime,
                                                [&times](const auto& time) { times.push_back(time); });
  network_.RunFor(kSecondUs);
  Slices(1, 2, kFirst);
  Fused(1, kFirst);
  network_.RunFor(kSecondUs);
  ASSERT_EQ(times.size(), 1U);
  EXPECT_EQ(times[0].utime, kFirst);
}

TEST(RegistrationConfigRange, AStartBeyondWhatTheRegistrationAllowsIsRefusedByItsKey) {
  const auto file = ConfigFile::Parse("[registration]\nstart_rotation_rad = 0.6\n", "station.toml");
  ASSERT_TRUE(file.ok());
  const auto config = RegistrationConfig::Load(file->Table("registration"));
  ASSERT_FALSE(config.ok());
  EXPECT_THAT(config.error().message, HasSubstr("start_rotation_rad is 0.6"));
}

}  // namespace
}  // namespace forgescan
