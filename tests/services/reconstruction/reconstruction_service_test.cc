#include "services/reconstruction/reconstruction_service.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <opencv2/core.hpp>

#include "services/common/bus/channels.h"
#include "services/common/bus/cloud_stream.h"
#include "services/common/bus/sim_bus.h"
#include "tests/services/reconstruction/fringe_scene.h"

namespace forgescan {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

constexpr std::int64_t kSecondUs = 1'000'000;
constexpr std::int64_t kFirstPulseUtime = 1'700'000'100'000'000;
constexpr std::int64_t kPulsePeriodUs = 20'000;
constexpr auto kLeft = fsmsg::exposure_t::CAMERA_LEFT;
constexpr auto kRight = fsmsg::exposure_t::CAMERA_RIGHT;

ReconstructionServiceConfig Config() {
  ReconstructionServiceConfig config;
  config.reconstruction.noise = {.read_noise_dn = 0.6, .gain_dn = 0};
  return config;
}

// The reconstruction service, and the camera and trigger services around it. Images of one surface serve all
// views.
class ReconstructionServiceTest : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    const Eigen::Vector3d normal = Eigen::Vector3d(0.15, -0.1, -1).normalized();
    plane_ = new StereoFrames(
        Render(Plane(normal, -400), SmallRig(), SmallPattern(Background::kShared), {.noise_dn = 0.5}));
  }
  static void TearDownTestSuite() { delete plane_; }

  ReconstructionServiceTest() {
    listener_.Subscribe<fsmsg::view_result_t>(kViewResult,
                                              [this](const auto& result) { results_.push_back(result); });
    listener_.Subscribe<fsmsg::cloud_slice_t>(kViewCloud, [this](const auto& slice) {
      if (auto cloud = assembler_.Add(slice); cloud.ok() && cloud->has_value()) {
        clouds_[{slice.part, slice.view}] = std::move(**cloud);
      }
    });
    network_.RunFor(kSecondUs);
  }

  static int FrameCount() { return SmallPattern(Background::kShared).frame_count(); }
  static std::int64_t LastPulseUtime() {
    return kFirstPulseUtime + kPulsePeriodUs * (FrameCount() - 1) + kPulsePeriodUs / 2;
  }

  void Frame(int part, int view, std::int8_t camera, int pattern, const StereoFrames& images) {
    const cv::Mat& image = (camera == kLeft ? images.left : images.right)[static_cast<std::size_t>(pattern)];
    fsmsg::frame_t frame{};
    frame.utime = kFirstPulseUtime + kPulsePeriodUs * pattern + (camera == kRight ? kPulsePeriodUs / 2 : 0);
    frame.part = part;
    frame.view = view;
    frame.camera = camera;
    frame.pattern = pattern;
    frame.width_px = image.cols;
    frame.height_px = image.rows;
    frame.data.assign(image.begin<std::uint8_t>(), image.end<std::uint8_t>());
    frame.size = static_cast<std::int32_t>(frame.data.size());
    ASSERT_TRUE(cameras_.Publish(camera == kLeft ? kFrameLeft : kFrameRight, frame).ok());
  }
  void Manifest(int part, int view, std::int8_t camera, int missing = 0, const std::string& reason = "") {
    fsmsg::view_frames_t manifest{};
    manifest.utime = LastPulseUtime();
    manifest.part = part;
    manifest.view = view;
    manifest.camera = camera;
    manifest.frames_expected = FrameCount();
    manifest.frames_sent = FrameCount() - missing;
    manifest.frames_missing = missing;
    manifest.reason = reason;
    ASSERT_TRUE(cameras_.Publish(camera == kLeft ? kViewFramesLeft : kViewFramesRight, manifest).ok());
  }
  void Captured(int part, int view, const std::string& reason = "") {
    fsmsg::view_captured_t captured{};
    captured.utime = LastPulseUtime();
    captured.part = part;
    captured.view = view;
    captured.status =
        reason.empty() ? fsmsg::view_captured_t::STATUS_CAPTURED : fsmsg::view_captured_t::STATUS_VOID;
    captured.pulses_expected = FrameCount();
    captured.reason = reason;
    ASSERT_TRUE(trigger_.Publish(kViewCaptured, captured).ok());
  }
  void End(int part, int view) {
    Captured(part, view);
    Manifest(part, view, kLeft);
    Manifest(part, view, kRight);
  }
  void WholeView(int part, int view, const StereoFrames& images = *plane_) {
    for (int pattern = 0; pattern < FrameCount(); ++pattern) {
      Frame(part, view, kLeft, pattern, images);
      Frame(part, view, kRight, pattern, images);
    }
    End(part, view);
    network_.RunFor(kSecondUs);
  }
  void ExpectWorking() {
    const std::size_t before = results_.size();
    WholeView(99, 0);
    ASSERT_EQ(results_.size(), before + 1);
    EXPECT_EQ(results_.back().status, fsmsg::view_result_t::STATUS_OK) << results_.back().reason;
  }

  static StereoFrames* plane_;
  SimNetwork network_;
  StreamHub hub_{network_.AddNode(), "reconstruction"};
  StreamHub cameras_{network_.AddNode(), "cameras"};
  StreamHub trigger_{network_.AddNode(), "trigger"};
  StreamHub listener_{network_.AddNode(), "listener"};
  ServiceMonitor monitor_{hub_, "reconstruction", ""};
  ReconstructionService service_{hub_, monitor_, Config(), SmallPattern(Background::kShared), SmallRig()};
  CloudAssembler assembler_;
  std::vector<fsmsg::view_result_t> results_;
  std::map<std::pair<int, int>, PointCloud> clouds_;
};
StereoFrames* ReconstructionServiceTest::plane_ = nullptr;

TEST_F(ReconstructionServiceTest, Starts) { EXPECT_EQ(monitor_.state(), ServiceState::kReady); }

TEST_F(ReconstructionServiceTest, AWholeViewGivesWhatTheAlgorithmGives) {
  WholeView(3, 1);
  ReconstructionConfig config = Config().reconstruction;
  config.keep_every_nth_point = 8;
  const auto expected =
      Reconstruct(plane_->left, plane_->right, SmallPattern(Background::kShared), SmallRig(), config);
  ASSERT_TRUE(expected.ok()) << expected.error().message;
  ASSERT_EQ(results_.size(), 1u);
  const fsmsg::view_result_t& result = results_[0];
  EXPECT_EQ(result.status, fsmsg::view_result_t::STATUS_OK) << result.reason;
  EXPECT_EQ(result.part, 3);
  EXPECT_EQ(result.view, 1);
  EXPECT_EQ(result.frames_expected, 2 * FrameCount());
  EXPECT_EQ(result.frames_used, 2 * FrameCount());
  // The middle between the first pulse of the left and the last of the right camera.
  EXPECT_EQ(result.utime, kFirstPulseUtime + (LastPulseUtime() - kFirstPulseUtime) / 2);
  const CameraQuality& left = expected->quality.left;
  EXPECT_EQ(result.pixels_valid, left.pixels[static_cast<std::size_t>(MaskCause::kValid)]);
  EXPECT_EQ(result.mask_saturated, left.pixels[static_cast<std::size_t>(MaskCause::kSaturated)]);
  EXPECT_EQ(result.modulation_median_dn, left.median_modulation_dn);
  EXPECT_EQ(result.sigma_median_mm, expected->quality.median_sigma_mm);
  const PointCloud& cloud = clouds_[std::make_pair(3, 1)];
  EXPECT_EQ(result.points, static_cast<int>(expected->cloud_in_camera.size()));
  EXPECT_NEAR(result.points, static_cast<double>(expected->quality.stereo.points) / 8,
              120);  // half a point a row
  ASSERT_EQ(cloud.size(), static_cast<std::size_t>(result.points));
  EXPECT_EQ(cloud.points[1], expected->cloud_in_camera.points[1]);
  EXPECT_EQ(cloud.view.front(), 1);
  EXPECT_EQ(monitor_.counter("views_reconstructed"), 1);
}

TEST_F(ReconstructionServiceTest, AVoidCaptureIsVoidAtOnceWithItsReason) {
  Frame(1, 0, kLeft, 0, *plane_);
  Captured(1, 0, "the robot left its position");
  network_.RunFor(kSecondUs);
  ASSERT_EQ(results_.size(), 1u);
  EXPECT_EQ(results_[0].status, fsmsg::view_result_t::STATUS_VOID);
  EXPECT_EQ(results_[0].reason, "the robot left its position");
  EXPECT_EQ(results_[0].points, 0);
  EXPECT_TRUE(clouds_.empty());
  ExpectWorking();
}

TEST_F(ReconstructionServiceTest, AMissingFrameVoidsTheViewWithTheCamerasReason) {
  for (int pattern = 1; pattern < FrameCount(); ++pattern) {
    Frame(1, 0, kLeft, pattern, *plane_);
  }
  Captured(1, 0);
  Manifest(1, 0, kLeft, 1, "pulse 17 brought no image in time");
  network_.RunFor(kSecondUs);
  ASSERT_EQ(results_.size(), 1u);
  EXPECT_EQ(results_[0].status, fsmsg::view_result_t::STATUS_VOID);
  EXPECT_EQ(results_[0].reason, "pulse 17 brought no image in time");
  EXPECT_EQ(results_[0].frames_used, FrameCount() - 1);
  ExpectWorking();
}

TEST_F(ReconstructionServiceTest, ACameraThatSaysNothingEndsInATimeout) {
  for (int pattern = 0; pattern < FrameCount(); ++pattern) {
    Frame(1, 0, kLeft, pattern, *plane_);
  }
  Captured(1, 0);
  Manifest(1, 0, kLeft);
  network_.RunFor(29 * kSecondUs);
  EXPECT_TRUE(results_.empty());
  network_.RunFor(2 * kSecondUs);
  ASSERT_EQ(results_.size(), 1u);
  EXPECT_THAT(results_[0].reason, AllOf(HasSubstr("7 of 14 frames"), HasSubstr("30 s")));
  EXPECT_EQ(monitor_.counter("views_void"), 1);
  ExpectWorking();
}

TEST_F(ReconstructionServiceTest, ImagesOfNothingButNoiseGiveNoPoints) {
  StereoFrames noise = *plane_;
  cv::RNG random(5);
  for (auto* camera : {&noise.left, &noise.right}) {
    for (cv::Mat& image : *camera) {
      image = image.clone();
      random.fill(image, cv::RNG::NORMAL, 100, 20);
    }
  }
  WholeView(1, 0, noise);
  ASSERT_EQ(results_.size(), 1u);
  EXPECT_EQ(results_[0].status, fsmsg::view_result_t::STATUS_VOID);
  EXPECT_FALSE(results_[0].reason.empty());
  EXPECT_THAT(monitor_.last_error(), HasSubstr("part 1 view 0"));
  EXPECT_TRUE(clouds_.empty());
  ExpectWorking();
}

TEST_F(ReconstructionServiceTest, ImagesOfUnequalSizeAreRefused) {
  StereoFrames uneven = *plane_;
  uneven.right[2] = uneven.right[2](cv::Rect(0, 0, 160, 120)).clone();
  WholeView(1, 0, uneven);
  ASSERT_EQ(results_.size(), 1u);
  EXPECT_EQ(results_[0].status, fsmsg::view_result_t::STATUS_VOID);
  EXPECT_FALSE(results_[0].reason.empty());
  ExpectWorking();
}

TEST_F(ReconstructionServiceTest, TwoViewsMayInterleave) {
  for (int pattern = 0; pattern < FrameCount(); ++pattern) {
    for (const int view : {0, 1}) {
      Frame(1, view, kLeft, pattern, *plane_);
      Frame(1, view, kRight, FrameCount() - 1 - pattern, *plane_);
    }
  }
  End(1, 1);
  network_.RunFor(kSecondUs);
  ASSERT_EQ(results_.size(), 1u);
  EXPECT_EQ(results_[0].view, 1);
  End(1, 0);
  network_.RunFor(kSecondUs);
  ASSERT_EQ(results_.size(), 2u);
  EXPECT_EQ(results_[1].status, fsmsg::view_result_t::STATUS_OK) << results_[1].reason;
  EXPECT_EQ(clouds_[std::make_pair(1, 0)].points, clouds_[std::make_pair(1, 1)].points);
}

TEST_F(ReconstructionServiceTest, LossOnTheBusChangesNothing) {
  WholeView(1, 0);
  network_.SetFaults({.loss = 0.2, .large_loss = 0.5, .duplicate = 0.2, .jitter_us = 50'000});
  WholeView(2, 0);
  network_.RunFor(20 * kSecondUs);
  ASSERT_EQ(results_.size(), 2u);
  EXPECT_EQ(results_[1].status, fsmsg::view_result_t::STATUS_OK) << results_[1].reason;
  EXPECT_EQ(clouds_[std::make_pair(1, 0)].points, clouds_[std::make_pair(2, 0)].points);
  EXPECT_GT(hub_.counters().recovered, 0);
}

}  // namespace
}  // namespace forgescan
