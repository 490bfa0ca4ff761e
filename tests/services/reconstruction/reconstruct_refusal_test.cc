// Inputs that decode and match well and still belong to another rig, another frame or another exposure.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <opencv2/core.hpp>

#include "services/reconstruction/reconstruct.h"
#include "tests/services/reconstruction/fringe_scene.h"

namespace forgescan {
namespace {

using ::testing::HasSubstr;

const Eigen::Vector3d kNormal = Eigen::Vector3d(0.15, -0.1, -1).normalized();
constexpr double kOffsetMm = -400;

ReconstructionConfig SmallConfig(double noise_dn) {
  ReconstructionConfig config;
  config.noise = {.read_noise_dn = std::hypot(noise_dn, 0.29),
                  .gain_dn = 0};  // 0.29: rounding to whole grey values
  return config;
}

StereoFrames Flipped(const StereoFrames& frames, int how) {
  StereoFrames flipped;
  for (const auto& [from, to] :
       {std::pair(&frames.left, &flipped.left), std::pair(&frames.right, &flipped.right)}) {
    for (const cv::Mat& frame : *from) {
      cv::flip(frame, to->emplace_back(), how);
    }
  }
  return flipped;
}

// Without a calibrated projector, only its columns can tell: of a flat scene, and of one with enough relief
// and field for perspective to matter. In this symmetric
// rig a small sphere would pass, inside out.
TEST(ReconstructRefusal, RefusesExchangedAndTurnedImages) {
  const PatternSet pattern = SmallPattern(Background::kOwn);
  StereoCalibration rig = SmallRig();
  rig.projector.reset();
  const Surface background = Plane({0, 0, 1}, 500);
  const Surface ball = Sphere({5, -3, 360}, 45);
  const Surface deep = [&](const Ray& ray) {
    const auto hit = ball(ray);
    return hit ? hit : background(ray);
  };
  for (const Surface& surface : {Plane(kNormal, kOffsetMm), deep}) {
    const auto good = Render(surface, SmallRig(), pattern, {.noise_dn = 0.5});
    const auto run = [&](const StereoFrames& frames) {
      return Reconstruct(frames.left, frames.right, pattern, rig, SmallConfig(0.5));
    };
    const auto right = run(good);
    ASSERT_TRUE(right.ok()) << right.error().message;
    const auto& figures = right->quality.projector_consistency.value();
    // px; a fringe image of B = 80 DN and noise of 0.6 DN knows its column to 0.02 px
    EXPECT_LT(figures.column_rms_px, 0.04);
    EXPECT_LT(figures.flat_parallax_px, 5 * figures.flat_column_rms_px);  // 2: the projector is half way
    const std::array wrong = {StereoFrames{.left = good.right, .right = good.left}, Flipped(good, -1)};
    for (const StereoFrames& frames : wrong) {
      const auto result = run(frames);
      EXPECT_FALSE(result.ok()) << result->quality.projector_consistency->column_rms_px << " px, flat "
                                << result->quality.projector_consistency->flat_column_rms_px
                                << " px, cameras " << result->quality.projector_consistency->flat_parallax_px
                                << " px";
    }
  }
}

TEST(ReconstructRefusal, RefusesACalibrationThatCannotBelongToTheFrames) {
  const PatternSet pattern = SmallPattern(Background::kOwn);
  const auto refusal = [&](const auto& change) {
    StereoCalibration rig = SmallRig();
    rig.image_size.reset();
    change(rig);
    const auto made = Reconstructor::Create(pattern, rig, {320, 240}, SmallConfig(0));
    return made.ok() ? std::string("accepted") : made.error().message;
  };
  EXPECT_EQ(refusal([](StereoCalibration&) {}), "accepted");
  EXPECT_THAT(refusal([](StereoCalibration& rig) { rig.left.camera_matrix.topRows(2) *= 2; }),
              HasSubstr("the principal point of the left camera is at x = 322.6 px"));
  EXPECT_THAT(refusal([](StereoCalibration& rig) { rig.right.camera_matrix(1, 2) = 20; }),
              HasSubstr("the principal point of the right camera is at y = 20.0 px"));
  EXPECT_THAT(
      refusal([](StereoCalibration& rig) { rig.right.camera_matrix.diagonal().head(2).setConstant(50); }),
      HasSubstr("the right camera would see 145.3 degrees"));
  EXPECT_THAT(refusal([](StereoCalibration& rig) { rig.left.camera_matrix.diagonal().head(2) *= 1.2; }),
              HasSubstr("between 602.0 and 720.0 px"));
  EXPECT_THAT(refusal([](StereoCalibration& rig) { rig.left.distortion[0] = 100; }),
              HasSubstr("shifts a corner of the frame"));
  EXPECT_THAT(refusal([](StereoCalibration& rig) { rig.left.distortion[0] = -6; }),
              HasSubstr("folds the image over"));
  EXPECT_THAT(refusal([](StereoCalibration& rig) { rig.right.distortion[1] = -100; }),
              HasSubstr("folds the image over"));
}

TEST(ReconstructRefusal, NoticesGreyValuesCutOffBelowFullScale) {
  const PatternSet pattern = SmallPattern(Background::kOwn);
  const auto good = Render(Plane(kNormal, kOffsetMm), SmallRig(), pattern, {.noise_dn = 1});
  const auto cut_at = [&](double level_dn) {
    StereoFrames cut = good;
    for (auto* camera : {&cut.left, &cut.right}) {
      for (cv::Mat& frame : *camera) {
        frame = cv::min(frame, level_dn);
      }
    }
    return Reconstruct(cut.left, cut.right, pattern, SmallRig(), SmallConfig(1));
  };
  const auto whole = Reconstruct(good.left, good.right, pattern, SmallRig(), SmallConfig(1));
  ASSERT_TRUE(whole.ok()) << whole.error().message;
  EXPECT_FALSE(whole->quality.left.clipping_dn.has_value());
  const auto cut = cut_at(150);  // A + B = 190
  ASSERT_FALSE(cut.ok());
  EXPECT_THAT(cut.error().message, HasSubstr("saturated"));
}

}  // namespace
}  // namespace forgescan
