// A report service on a simulated bus, a line that feeds it, and an evaluator that is easy to predict.
#pragma once

#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>

#include "services/common/bus/channels.h"
#include "services/common/bus/sim_bus.h"
#include "tests/services/report/sample_report.h"

namespace forgescan {

inline constexpr std::int64_t kSecondUs = 1'000'000;

// Measures the extent of the cloud along x: enough to see that the right cloud reached the verdict.
class ExtentEvaluator final : public PartEvaluator {
 public:
  std::vector<MeasuredDimension> Dimensions() const override {
    MeasuredDimension length;
    length.name = "total length";
    length.nominal_mm = 1888.0;
    length.lower_mm = 1880.0;
    length.upper_mm = 1890.0;
    length.reference_degc = 900.0;
    return {length};
  }
  Result<std::vector<MeasuredDimension>> Evaluate(const PointCloud& cloud_in_model) const override {
    if (cloud_in_model.empty()) {
      return Fail(ErrorCode::kDegenerate, "the cloud is empty");
    }
    std::vector<MeasuredDimension> dimensions = Dimensions();
    double low_mm = 0.0, high_mm = 0.0;
    for (const Eigen::Vector3f& point : cloud_in_model.points) {
      low_mm = std::min<double>(low_mm, point.x());
      high_mm = std::max<double>(high_mm, point.x());
    }
    dimensions[0].measured_mm = high_mm - low_mm;
    dimensions[0].points = static_cast<int>(cloud_in_model.size());
    return dimensions;
  }
  Result<std::vector<float>> DeviationsMm(const PointCloud& cloud_in_model) const override {
    return std::vector<float>(cloud_in_model.size(), 0.1F);
  }
  const std::vector<Eigen::Vector3f>& ModelPoints() const override { return model_points_; }

 private:
  std::vector<Eigen::Vector3f> model_points_;
};

inline fsmsg::registration_t Registration(int part, std::int8_t status) {
  fsmsg::registration_t message{};
  message.utime = 1'700'000'027'000'000 + 45 * kSecondUs * part;
  message.part = part;
  message.status = status;
  message.reason = status == fsmsg::registration_t::STATUS_CONVERGED ? "" : "The start lies 40 mm off.";
  message.rms_mm = 0.03;
  message.reference_degc = 900.0;
  message.model_from_array[0] = 1.0;
  return message;
}

inline fsmsg::fusion_result_t Fusion(int part) {
  fsmsg::fusion_result_t message{};
  message.utime = Registration(part, 0).utime;
  message.part = part;
  message.status = fsmsg::view_result_t::STATUS_OK;
  message.reference_degc = 900.0;
  message.frames_expected = 160;
  message.frames_used = 158;
  message.scan_start_utime = message.utime - 27 * kSecondUs;
  message.view_count = 1;
  message.views.resize(1);
  message.views[0].status = fsmsg::view_result_t::STATUS_OK;
  message.views[0].temperature_degc = 905.0;
  message.views[0].scale = 0.9999;
  return message;
}

class ReportServiceTest : public ::testing::Test {
 protected:
  // services: of the station; none = the test starts the service itself.
  explicit ReportServiceTest(const std::vector<std::string>& services = {"report"}) {
    std::filesystem::remove_all(folder_);
    listener_.Subscribe<fsmsg::verdict_t>(kVerdict,
                                          [this](const auto& verdict) { verdicts_.push_back(verdict); });
    if (!services.empty()) {
      Start(services);
    }
    network_.RunFor(kSecondUs);
  }
  ~ReportServiceTest() override {
    service_.reset();
    std::filesystem::remove_all(folder_);
  }

  void Start(const std::vector<std::string>& services) {
    config_.picture_width_px = 400;
    const ReportStation station{"test <station>", "0.1.0", "01234567", folder_.string(), services};
    auto service = ReportService::Create(hub_, monitor_, config_, station, evaluator_);
    ASSERT_TRUE(service.ok()) << service.error().message;
    service_ = *service;
  }
  void Arrive(int part) {
    fsmsg::part_arrived_t message{};
    message.utime = Fusion(part).scan_start_utime;
    message.part = part;
    ASSERT_TRUE(line_.Publish(kPartArrived, message).ok());
  }
  void SendCloud(int part) {
    const auto slices = SliceCloud(cloud_, Fusion(part).utime, part, kAllViews);
    ASSERT_TRUE(slices.ok());
    for (const auto& slice : *slices) {
      ASSERT_TRUE(line_.Publish(kRegisteredCloud, slice).ok());
    }
  }
  void SendRegistration(int part, std::int8_t status) {
    fsmsg::registration_t message = Registration(part, status);
    message.points = static_cast<std::int32_t>(cloud_.size());
    ASSERT_TRUE(line_.Publish(kRegistration, message).ok());
  }
  void SendGood(int part) {
    Arrive(part);
    ASSERT_TRUE(line_.Publish(kFusionResult, Fusion(part)).ok());
    SendCloud(part);
    SendRegistration(part, fsmsg::registration_t::STATUS_CONVERGED);
  }
  // offset_us: of what the step worked on, against the end of the scan.
  void SendDuration(const Channel<fsmsg::processing_time_t>& channel, const char* step, int part,
                    std::int64_t us, std::int64_t offset_us = 0) {
    fsmsg::processing_time_t message{};
    message.utime = Fusion(part).utime + offset_us;
    message.part = part;
    message.step = step;
    message.duration_us = us;
    ASSERT_TRUE(line_.Publish(channel, message).ok());
  }
  nlohmann::json ReadJson(const fsmsg::verdict_t& verdict) const {
    return nlohmann::json::parse(std::ifstream(folder_ / verdict.report_folder / "report.json"));
  }

  std::filesystem::path folder_ =
      std::filesystem::temp_directory_path() / fmt::format("forgescan-report-{}", getpid());
  PointCloud cloud_ = SampleAxle(12.0);
  ReportConfig config_;
  ExtentEvaluator evaluator_;
  SimNetwork network_{1, 1'700'000'100'000'000};
  StreamHub line_{network_.AddNode(), "line"};
  StreamHub listener_{network_.AddNode(), "listener"};
  StreamHub hub_{network_.AddNode(), "report"};
  ServiceMonitor monitor_{hub_, "report", "01234567"};
  std::vector<fsmsg::verdict_t> verdicts_;
  std::shared_ptr<ReportService> service_;
};

}  // namespace forgescan
