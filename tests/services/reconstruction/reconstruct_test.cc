#include "services/reconstruction/reconstruct.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <cstring>
#include <opencv2/calib3d.hpp>
#include <opencv2/core.hpp>
#include <opencv2/core/eigen.hpp>

#include "tests/services/reconstruction/fringe_scene.h"

namespace forgescan {
namespace {

using ::testing::HasSubstr;

const Eigen::Vector3d kNormal = Eigen::Vector3d(0.15, -0.1, -1).normalized();
constexpr double kOffsetMm = -400;
const Eigen::Vector3d kCenterMm(5, -3, 430);
constexpr double kRadiusMm = 45;

ReconstructionConfig SmallConfig(double noise_dn) {
  ReconstructionConfig config;
  config.noise = {.read_noise_dn = std::hypot(noise_dn, 0.29),
                  .gain_dn = 0};  // 0.29: rounding to whole grey values
  return config;
}

Eigen::Matrix3d RectifiedFromLeft(const StereoCalibration& rig) {
  cv::Mat kl, kr, r, t, r1, r2, p1, p2, q;
  cv::eigen2cv(rig.left.camera_matrix, kl);
  cv::eigen2cv(rig.right.camera_matrix, kr);
  cv::eigen2cv(rig.right_from_left.rotation, r);
  cv::eigen2cv(rig.right_from_left.translation_mm, t);
  cv::stereoRectify(kl, rig.left.distortion, kr, rig.right.distortion,
                    {rig.image_size->width_px, rig.image_size->height_px}, r, t, r1, r2, p1, p2, q);
  Eigen::Matrix3d rotation;
  cv::cv2eigen(r1, rotation);
  return rotation;
}

Result<Reconstruction> RunSmall(const StereoFrames& frames, Background background,
                                const ReconstructionConfig& config) {
  return Reconstruct(frames.left, frames.right, SmallPattern(background), SmallRig(), config);
}

struct PlaneErrors {
  double rms_mm = 0;
  double mean_mm = 0;
  double rms_in_sigma = 0;  // along the view ray, over the predicted sigma
  double worst_normal_deg = 0;
};

PlaneErrors AgainstPlane(const PointCloud& cloud) {
  const Eigen::Vector3d normal = RectifiedFromLeft(SmallRig()) * kNormal;
  PlaneErrors errors;
  for (std::size_t i = 0; i < cloud.size(); ++i) {
    const Eigen::Vector3d p = cloud.points[i].cast<double>();
    const double off = normal.dot(p) - kOffsetMm;
    const double along_ray = off / normal.dot(p.normalized());
    errors.rms_mm += off * off;
    errors.mean_mm += off;
    errors.rms_in_sigma += std::pow(along_ray / static_cast<double>(cloud.sigma_mm[i]), 2);
    const double angle = std::acos(std::min(1.0, normal.dot(cloud.normals[i].cast<double>())));
    errors.worst_normal_deg = std::max(errors.worst_normal_deg, angle * 180 / M_PI);
  }
  const auto n = static_cast<double>(cloud.size());
  errors.rms_mm = std::sqrt(errors.rms_mm / n);
  errors.mean_mm /= n;
  errors.rms_in_sigma = std::sqrt(errors.rms_in_sigma / n);
  return errors;
}

TEST(Reconstruct, StartsOnAPlaneOfKnownPlace) {
  for (const Background background : {Background::kOwn, Background::kShared}) {
    const auto frames =
        Render(Plane(kNormal, kOffsetMm), SmallRig(), SmallPattern(background), {.noise_dn = 0});
    const auto result = RunSmall(frames, background, SmallConfig(0));
    ASSERT_TRUE(result.ok()) << result.error().message;
    EXPECT_GT(result->cloud_in_camera.size(), 30000U);
    const PlaneErrors errors = AgainstPlane(result->cloud_in_camera);
    // Rounding to whole grey values (0.29 of B = 80) leaves 0.02 mm a point at this coarse rig: Z^2/(b f)
    // = 2.2 mm per px.
    EXPECT_LT(errors.rms_mm, 0.03);
    EXPECT_LT(std::abs(errors.mean_mm), 0.003);
    EXPECT_LT(errors.worst_normal_deg, 5);
  }
}

// What the reference frame should show is made of noisy frames itself.
TEST(Reconstruct, NoiseOfTheKnownSizeIsNoContradictionToTheReferenceFrame) {
  constexpr double kNoiseDn = 1.5;
  PatternSet pattern = SmallPattern(Background::kShared);
  auto frames = Render(Plane(kNormal, kOffsetMm), SmallRig(), pattern, {.noise_dn = kNoiseDn});
  pattern.reference_frame_index = pattern.frame_count();
  pattern.frame_names.push_back("white");
  cv::RNG random(3);
  for (auto* camera : {&frames.left, &frames.right}) {
    cv::Mat white(camera->front().size(), CV_32F);
    random.fill(white, cv::RNG::NORMAL, 110 + 80, kNoiseDn);  // A + B of the scene
    white.convertTo(camera->emplace_back(), CV_8U);
  }
  const auto result = Reconstruct(frames.left, frames.right, pattern, SmallRig(), SmallConfig(kNoiseDn));
  ASSERT_TRUE(result.ok()) << result.error().message;
  const auto& pixels = result->quality.left.pixels;
  // 5 sigma: none of 76,800 pixels by noise; a few at the ends of the projector's field.
  EXPECT_LT(pixels[static_cast<std::size_t>(MaskCause::kReference)], 8);
  EXPECT_GT(result->cloud_in_camera.size(), 30000U);
}

TEST(Reconstruct, PredictsItsOwnNoise) {
  for (const Background background : {Background::kOwn, Background::kShared}) {
    const auto frames =
        Render(Plane(kNormal, kOffsetMm), SmallRig(), SmallPattern(background), {.noise_dn = 1.5});
    const auto result = RunSmall(frames, background, SmallConfig(1.5));
    ASSERT_TRUE(result.ok()) << result.error().message;
    const PlaneErrors errors = AgainstPlane(result->cloud_in_camera);
    EXPECT_NEAR(errors.rms_in_sigma, 1,
                0.1);  // 30,000 points know it to 1 %; slope noise and cut tails take the rest
    EXPECT_LT(std::abs(errors.mean_mm), 0.01);
  }
}

TEST(Reconstruct, FindsASphere) {
  const auto frames =
      Render(Sphere(kCenterMm, kRadiusMm), SmallRig(), SmallPattern(Background::kOwn), {.noise_dn = 0});
  const auto result = RunSmall(frames, Background::kOwn, SmallConfig(0));
  ASSERT_TRUE(result.ok()) << result.error().message;
  const Eigen::Vector3d center = RectifiedFromLeft(SmallRig()) * kCenterMm;
  double sum = 0, square = 0;
  for (std::size_t i = 0; i < result->cloud_in_camera.size(); ++i) {
    const Eigen::Vector3d from_center = result->cloud_in_camera.points[i].cast<double>() - center;
    const double off = from_center.norm() - kRadiusMm;
    sum += off;
    square += off * off;
    ASSERT_GT(from_center.normalized().dot(result->cloud_in_camera.normals[i].cast<double>()), 0.9);
  }
  const auto n = static_cast<double>(result->cloud_in_camera.size());
  EXPECT_GT(n, 5000);
  EXPECT_LT(std::abs(sum / n),
            0.01);  // mm; mean of 5000 points of 0.05 mm, and the chord of linear interpolation
  EXPECT_LT(std::sqrt(square / n), 0.06);  // mm; rounding, larger where the sphere turns away
}

TEST(Reconstruct, GivesTheSameBytesForAnyNumberOfThreads) {
  const auto frames =
      Render(Plane(kNormal, kOffsetMm), SmallRig(), SmallPattern(Background::kOwn), {.noise_dn = 1});
  ReconstructionConfig config = SmallConfig(1);
  config.threads = 1;
  const auto one = RunSmall(frames, Background::kOwn, config);
  config.threads = 3;
  const auto three = RunSmall(frames, Background::kOwn, config);
  ASSERT_TRUE(one.ok() && three.ok());
  ASSERT_EQ(one->cloud_in_camera.size(), three->cloud_in_camera.size());
  const std::size_t bytes = one->cloud_in_camera.size() * sizeof(Eigen::Vector3f);
  EXPECT_EQ(std::memcmp(one->cloud_in_camera.points.data(), three->cloud_in_camera.points.data(), bytes), 0);
  EXPECT_EQ(std::memcmp(one->cloud_in_camera.normals.data(), three->cloud_in_camera.normals.data(), bytes),
            0);
  EXPECT_EQ(one->cloud_in_camera.sigma_mm, three->cloud_in_camera.sigma_mm);
}

TEST(Reconstruct, MeasuresTheHarmonicAndRefusesItOnlyWithASharedBackground) {
  const Lighting bent = {.modulation_dn = 70, .noise_dn = 1, .second_harmonic = 0.12};
  const auto own =
      RunSmall(Render(Plane(kNormal, kOffsetMm), SmallRig(), SmallPattern(Background::kOwn), bent),
               Background::kOwn, SmallConfig(1));
  ASSERT_TRUE(own.ok()) << own.error().message;
  EXPECT_NEAR(own->quality.left.trust.second_harmonic_ratio.value(), 0.12,
              0.005);                                                // noise over 20,000 pixels: 0.001
  EXPECT_NEAR(own->quality.left.trust.noise_dn.value(), 1.04, 0.1);  // 1 DN and the rounding
  const auto shared =
      RunSmall(Render(Plane(kNormal, kOffsetMm), SmallRig(), SmallPattern(Background::kShared), bent),
               Background::kShared, SmallConfig(1));
  ASSERT_FALSE(shared.ok());
  EXPECT_EQ(shared.error().code, ErrorCode::kUntrusted);
  EXPECT_THAT(shared.error().message, HasSubstr("not linear enough for a shared background"));
}

TEST(Reconstruct, SuspectsAWeakHarmonicToo) {
  const Lighting bent = {.noise_dn = 0.5, .second_harmonic = 0.04};
  const auto shared =
      RunSmall(Render(Plane(kNormal, kOffsetMm), SmallRig(), SmallPattern(Background::kShared), bent),
               Background::kShared, SmallConfig(0.5));
  ASSERT_FALSE(shared.ok());
  EXPECT_THAT(shared.error().message, HasSubstr("not linear enough"));
}

TEST(Reconstruct, RefusesWhatCannotBeTrustedAndGoesOn) {
  const PatternSet pattern = SmallPattern(Background::kOwn);
  const auto good = Render(Plane(kNormal, kOffsetMm), SmallRig(), pattern, {.noise_dn = 1});
  const auto reconstructor =
      Reconstructor::Create(pattern, SmallRig(), *SmallRig().image_size, SmallConfig(1));
  ASSERT_TRUE(reconstructor.ok()) << reconstructor.error().message;
  const auto bright = Render(Plane(kNormal, kOffsetMm), SmallRig(), pattern, {.background_dn = 190});
  EXPECT_THAT(reconstructor->Run(bright.left, bright.right).error().message, HasSubstr("saturated"));
  const auto dark = Render(Plane(kNormal, kOffsetMm), SmallRig(), pattern, {.modulation_dn = 2});
  EXPECT_THAT(reconstructor->Run(dark.left, dark.right).error().message, HasSubstr("no pixel shows fringes"));
  EXPECT_FALSE(reconstructor->Run(good.left, good.left).ok());  // one camera twice
  auto mixed_up = good;
  std::swap(mixed_up.left[1], mixed_up.left[6]);
  EXPECT_EQ(reconstructor->Run(mixed_up.left, mixed_up.right).error().code, ErrorCode::kUntrusted);
  EXPECT_TRUE(reconstructor->Run(good.left, good.right).ok());
}

TEST(Reconstruct, RefusesWrongFrames) {
  const PatternSet pattern = SmallPattern(Background::kOwn);
  const auto good = Render(Plane(kNormal, kOffsetMm), SmallRig(), pattern, {.noise_dn = 1});
  auto missing = good;
  missing.left.pop_back();
  EXPECT_THAT(RunSmall(missing, Background::kOwn, SmallConfig(1)).error().message, HasSubstr("11 frames"));
  auto small = good;
  small.right[3] = small.right[3].rowRange(0, 100).clone();
  EXPECT_THAT(RunSmall(small, Background::kOwn, SmallConfig(1)).error().message,
              HasSubstr("frame 4 has 320 x 100"));
  auto colour = good;
  colour.left[0] = cv::Mat(240, 320, CV_8UC3, cv::Scalar(0, 0, 0));
  EXPECT_THAT(RunSmall(colour, Background::kOwn, SmallConfig(1)).error().message,
              HasSubstr("not a grey image"));
  auto empty = good;
  empty.left[2] = cv::Mat();
  EXPECT_FALSE(RunSmall(empty, Background::kOwn, SmallConfig(1)).ok());
  StereoCalibration other_size = SmallRig();
  other_size.image_size = ImageSize{640, 480};
  EXPECT_THAT(Reconstruct(good.left, good.right, pattern, other_size, SmallConfig(1)).error().message,
              HasSubstr("320 x 240 px, the calibration is for 640 x 480"));
}

TEST(Reconstruct, TheProjectorBetraysADriftedCalibration) {
  const PatternSet pattern = SmallPattern(Background::kOwn);
  const auto frames = Render(Plane(kNormal, kOffsetMm), SmallRig(), pattern, {.noise_dn = 1});
  const auto fresh = Reconstruct(frames.left, frames.right, pattern, SmallRig(), SmallConfig(1));
  ASSERT_TRUE(fresh.ok()) << fresh.error().message;
  EXPECT_NEAR(fresh->quality.median_projector_residual_px.value(), 0,
              0.01);  // px; 30,000 residuals of 0.1 px
  StereoCalibration drifted = SmallRig();
  drifted.right_from_left.rotation = Eigen::AngleAxisd(0.002, Eigen::Vector3d::UnitY()).toRotationMatrix() *
                                     drifted.right_from_left.rotation;
  const auto stale = Reconstruct(frames.left, frames.right, pattern, drifted, SmallConfig(1));
  ASSERT_FALSE(stale.ok());
  EXPECT_THAT(stale.error().message, HasSubstr("the calibration drifted"));
}

TEST(Reconstruct, SixteenBitFramesGiveTheSamePoints) {
  const PatternSet pattern = SmallPattern(Background::kOwn);
  const auto frames = Render(Plane(kNormal, kOffsetMm), SmallRig(), pattern, {.noise_dn = 1});
  auto wide = frames;
  for (auto* camera : {&wide.left, &wide.right}) {
    for (cv::Mat& frame : *camera) {
      cv::Mat scaled;
      frame.convertTo(scaled, CV_16U, 257);  // 255 becomes 65535
      frame = scaled;
    }
  }
  const auto narrow_result = RunSmall(frames, Background::kOwn, SmallConfig(1));
  const auto wide_result = RunSmall(wide, Background::kOwn, SmallConfig(1));
  ASSERT_TRUE(narrow_result.ok() && wide_result.ok());
  EXPECT_NEAR(AgainstPlane(wide_result->cloud_in_camera).rms_mm,
              AgainstPlane(narrow_result->cloud_in_camera).rms_mm, 1e-3);
}

TEST(ReconstructionConfig, RefusesNonsense) {
  ReconstructionConfig config;
  EXPECT_TRUE(Check(config).ok());
  config.max_left_right_px = std::nan("");
  EXPECT_THAT(Check(config).error().message, HasSubstr("max_left_right_px is nan"));
  config = {};
  config.threads = 0;
  EXPECT_FALSE(FringeDecoder::Create(SmallPattern(Background::kOwn), config).ok());
}

}  // namespace
}  // namespace forgescan
