// Real fringe images of a flat board (not part of the repository; skipped where absent).
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <cmath>
#include <filesystem>
#include <numbers>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>

#include "services/reconstruction/reconstruct.h"
#include "tests/common/real_data.h"

namespace forgescan {
namespace {

const std::filesystem::path kDirectory = RealData("real-fringe-plane").value_or("");

// Frames first, first + 3, ...: steps of 90 deg in a set of 12, for each of three periods.
PatternSet EveryThird(int first, std::array<int, 3> frames, Background background) {
  PatternSet pattern;
  pattern.projector_width_px = 1280;
  pattern.phase_origin_px = -1;
  pattern.background = background;
  const std::array<double, 3> periods_px = {28, 26, 24};
  for (std::size_t j = 0; j < 3; ++j) {
    FringeFrequency frequency{.period_px = periods_px[j], .frame_index = {}, .shift_rad = {}};
    for (int i = 0; i < frames[j]; ++i) {
      frequency.frame_index.push_back(pattern.frame_count());
      frequency.shift_rad.push_back((first - 1 + 3 * i) * std::numbers::pi / 6);
      pattern.frame_names.push_back(fmt::format("{:02}.png", first + 12 * static_cast<int>(j) + 3 * i));
    }
    pattern.frequencies.push_back(frequency);
  }
  return pattern;
}

std::vector<cv::Mat> ReadFrames(const std::string& camera, const PatternSet& pattern) {
  std::vector<cv::Mat> frames;
  for (const auto& name : pattern.frame_names) {
    frames.push_back(cv::imread((kDirectory / camera / name).string(), cv::IMREAD_UNCHANGED));
  }
  return frames;
}

Result<Reconstruction> RunSet(const PatternSet& pattern) {
  ASSIGN_OR_RETURN(const auto calibration, LoadStereoCalibration(kDirectory / "stereo_params.yaml"));
  return Reconstruct(ReadFrames("L", pattern), ReadFrames("R", pattern), pattern, calibration, {});
}

struct FittedPlane {
  Eigen::Vector3d normal;
  Eigen::Vector3d centroid;
  double sigma_mm;
};

FittedPlane Fit(const PointCloud& cloud) {
  Eigen::Vector3d centroid = Eigen::Vector3d::Zero();
  for (const auto& p : cloud.points) {
    centroid += p.cast<double>();
  }
  centroid /= static_cast<double>(cloud.size());
  Eigen::Matrix3d scatter = Eigen::Matrix3d::Zero();
  for (const auto& p : cloud.points) {
    const Eigen::Vector3d d = p.cast<double>() - centroid;
    scatter += d * d.transpose();
  }
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(scatter / static_cast<double>(cloud.size()));
  Eigen::Vector3d normal = solver.eigenvectors().col(0);
  return {normal.z() < 0 ? -normal : normal, centroid, std::sqrt(solver.eigenvalues()(0))};
}

class RealBoard : public ::testing::Test {
 protected:
  void SetUp() override {
    if (kDirectory.empty()) {
      GTEST_SKIP() << "real-fringe-plane" << kNoRealData;
    }
  }
};

TEST_F(RealBoard, TwoIndependentSetsGiveTheSamePlane) {
  const auto a = RunSet(EveryThird(1, {4, 4, 4}, Background::kOwn));
  const auto b = RunSet(EveryThird(2, {4, 4, 4}, Background::kOwn));
  ASSERT_TRUE(a.ok()) << a.error().message;
  ASSERT_TRUE(b.ok()) << b.error().message;
  EXPECT_GE(a->cloud_in_camera.size(), 550000U);
  EXPECT_GE(b->cloud_in_camera.size(), 550000U);
  const FittedPlane plane_a = Fit(a->cloud_in_camera);
  const FittedPlane plane_b = Fit(b->cloud_in_camera);
  EXPECT_LE(plane_a.sigma_mm, 0.05);  // mm; an independent reconstruction has 0.0445
  EXPECT_LE(plane_b.sigma_mm, 0.05);
  const double angle_deg = std::asin(plane_a.normal.cross(plane_b.normal).norm()) * 180 / std::numbers::pi;
  EXPECT_LT(angle_deg, 0.005);
  const double offset_mm = plane_a.normal.dot(plane_a.centroid - plane_b.centroid);
  EXPECT_LT(std::abs(offset_mm), 0.002);
  const Eigen::Vector3d known_normal(-0.0658, -0.0488, 0.9966);  // by others, four digits
  EXPECT_LT(std::asin(plane_a.normal.cross(known_normal.normalized()).norm()) * 180 / std::numbers::pi, 0.01);
  const double known = plane_a.normal.dot(plane_a.centroid);
  std::printf(
      "points %zu %zu, sigma %.4f %.4f mm, angle %.5f deg, offset %.5f mm, plane %.3f mm (%.4f %.4f %.4f)\n",
      a->cloud_in_camera.size(), b->cloud_in_camera.size(), plane_a.sigma_mm, plane_b.sigma_mm, angle_deg,
      offset_mm, known, plane_a.normal.x(), plane_a.normal.y(), plane_a.normal.z());
  EXPECT_NEAR(a->quality.left.trust.second_harmonic_ratio.value(), 0.15, 0.02);  // 0.13-0.17, by others
}

TEST_F(RealBoard, RefusesExchangedAndMirroredImages) {
  const PatternSet pattern = EveryThird(1, {4, 4, 4}, Background::kOwn);
  const auto calibration = LoadStereoCalibration(kDirectory / "stereo_params.yaml");
  ASSERT_TRUE(calibration.ok()) << calibration.error().message;
  auto left = ReadFrames("L", pattern);
  auto right = ReadFrames("R", pattern);
  const auto exchanged = Reconstruct(right, left, pattern, *calibration, {});
  ASSERT_FALSE(exchanged.ok());
  EXPECT_THAT(exchanged.error().message, ::testing::HasSubstr("exchanged or mirrored"));
  for (auto* camera : {&left, &right}) {
    for (cv::Mat& frame : *camera) {
      cv::flip(frame, frame, 1);
    }
  }
  const auto mirrored = Reconstruct(left, right, pattern, *calibration, {});
  ASSERT_FALSE(mirrored.ok());
  EXPECT_THAT(mirrored.error().message, ::testing::HasSubstr("exchanged or mirrored"));
}

TEST_F(RealBoard, RefusesGreyValuesCutOffBelowFullScale) {
  const PatternSet pattern = EveryThird(1, {4, 4, 4}, Background::kOwn);
  const auto calibration = LoadStereoCalibration(kDirectory / "stereo_params.yaml");
  ASSERT_TRUE(calibration.ok()) << calibration.error().message;
  auto left = ReadFrames("L", pattern);
  auto right = ReadFrames("R", pattern);
  for (auto* camera : {&left, &right}) {
    for (cv::Mat& frame : *camera) {
      frame.convertTo(frame, -1, 1.6);
      frame = cv::min(frame, 230);
    }
  }
  const auto cut = Reconstruct(left, right, pattern, *calibration, {});
  ASSERT_FALSE(cut.ok());
  EXPECT_THAT(cut.error().message, ::testing::HasSubstr("saturated"));
}

TEST_F(RealBoard, SaysThatTheProjectorIsNotLinearEnough) {
  const auto shared = RunSet(EveryThird(1, {3, 2, 2}, Background::kShared));
  ASSERT_FALSE(shared.ok());
  EXPECT_EQ(shared.error().code, ErrorCode::kUntrusted);
  EXPECT_THAT(shared.error().message, ::testing::HasSubstr("not linear enough for a shared background"));
}

}  // namespace
}  // namespace forgescan
