#include "services/common/calibration/refine_calibration.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "services/common/calibration/rig_geometry.h"
#include "tests/common/calibration/bar_scene.h"

namespace forgescan {
namespace {

using ::testing::HasSubstr;

constexpr double kBarMm = 125.0123;
const BallBar kBar{kBarMm, 0.0005, 0};

StereoCalibration Written() { return Corrected(TrueRig(), SomeError()); }

// Largest error of lengths of 100 mm elsewhere in the volume.
double WorstLength(const StereoCalibration& calibration) {
  const RigGeometry truth(TrueRig()), rig(calibration);
  double worst_mm = 0;
  for (const auto& place : BarPlaces(100)) {
    const std::vector<Eigen::Vector3d> seen = rig.Triangulated(truth.Seen(place));
    worst_mm = std::max(worst_mm, std::abs((seen[1] - seen[0]).norm() - 100));
  }
  return worst_mm;
}

// That placement's measured less certified distance with a refinement without it.
double WithoutIt(const BallBar& bar, const std::vector<BarPlacement>& all, std::size_t left_out) {
  std::vector<BarPlacement> others = all;
  others.erase(others.begin() + static_cast<std::ptrdiff_t>(left_out));
  const auto without = RefineCalibration(Written(), bar, others, BarOptions());
  if (!without.ok()) {
    ADD_FAILURE() << without.error().message;
    return std::nan("");
  }
  const RigGeometry before(Written()), after(without->calibration);
  const auto seen = after.Triangulated(before.Seen(all[left_out].center_in_camera));
  return (seen[1] - seen[0]).norm() - bar.distance_mm;
}

std::string Refusal(const std::vector<BarPlacement>& placements, const RefinementOptions& options,
                    ErrorCode code) {
  const auto refined = RefineCalibration(Written(), kBar, placements, options);
  if (refined.ok()) return "accepted";
  EXPECT_EQ(refined.error().code, code) << refined.error().message;
  return refined.error().message;
}

TEST(RefineCalibration, MendsLengthsEverywhereInTheVolume) {
  ASSERT_GT(WorstLength(Written()), 0.02);
  const auto refined = RefineCalibration(Written(), kBar, MeasuredBar(Written(), kBarMm, 0), BarOptions());
  ASSERT_TRUE(refined.ok()) << refined.error().message;
  EXPECT_LT(WorstLength(refined->calibration), 0.003);  // mm; what the prior and 3 um of a centre leave
  EXPECT_GT(LargestError(refined->placements, &PlacementErrors::before_mm), 0.02);
  EXPECT_LT(LargestError(refined->placements, &PlacementErrors::after_mm), 0.003);
  EXPECT_GE(refined->determined_directions, 3);
  EXPECT_TRUE(Check(refined->calibration).ok());
}

TEST(RefineCalibration, ARightCalibrationStays) {
  const auto refined = RefineCalibration(TrueRig(), kBar, MeasuredBar(TrueRig(), kBarMm, 0), BarOptions());
  ASSERT_TRUE(refined.ok()) << refined.error().message;
  EXPECT_LT(refined->correction.cwiseAbs().maxCoeff(), 1e-6);
  EXPECT_TRUE(refined->refined_from_present.isApprox(Eigen::Isometry3d::Identity(), 1e-6));
}

// A right camera that stands higher turns the rectified frame about the baseline, and changes no length.
TEST(RefineCalibration, WhatNoLengthShowsStays) {
  constexpr int kTranslationY = 14;
  RigVector error = RigVector::Zero();
  error(kTranslationY) = 0.02;
  const StereoCalibration written = Corrected(TrueRig(), error);
  const auto refined = RefineCalibration(written, kBar, MeasuredBar(written, kBarMm, 0), BarOptions());
  ASSERT_TRUE(refined.ok()) << refined.error().message;
  EXPECT_LT(std::abs(refined->correction(kTranslationY)), 0.0001);  // mm; a hundredth of the prior
  EXPECT_GT(refined->posterior_sigma(kTranslationY), 0.99 * BarOptions().prior.translation_mm);
  EXPECT_LT(refined->determined_directions, kRigParameters);
}

TEST(RefineCalibration, AParameterWithoutPriorIsHeld) {
  RefinementOptions options = BarOptions();
  options.prior.k1 = options.prior.rotation_rad = 0;
  const auto refined = RefineCalibration(Written(), kBar, MeasuredBar(Written(), kBarMm, 0), options);
  ASSERT_TRUE(refined.ok()) << refined.error().message;
  for (const int held : {4, 9, 10, 11, 12}) EXPECT_EQ(refined->correction(held), 0) << held;
  EXPECT_NE(refined->correction(0), 0);
}

TEST(RefineCalibration, ALeftOutErrorIsThatOfARefinementWithoutIt) {
  const std::vector<BarPlacement> all = MeasuredBar(Written(), kBarMm, 0.003);
  const auto refined = RefineCalibration(Written(), kBar, all, BarOptions());
  ASSERT_TRUE(refined.ok()) << refined.error().message;
  for (const std::size_t left_out : {std::size_t{0}, std::size_t{9}, std::size_t{15}}) {
    // mm; what is not linear
    EXPECT_NEAR(refined->placements[left_out].left_out_mm, WithoutIt(kBar, all, left_out), 0.0001);
    EXPECT_GT(refined->placements[left_out].left_out_sigma_mm, 0.003 * std::numbers::sqrt2);
  }
}

// A certificate that is wrong: what the lengths say of it is told, and no column hides it.
TEST(RefineCalibration, TheCertificatesCorrectionIsToldAndInNoError) {
  const BallBar bar{kBarMm + 0.05, 0.04, 0};
  const std::vector<BarPlacement> all = MeasuredBar(Written(), kBarMm, 0.001);
  const auto refined = RefineCalibration(Written(), bar, all, BarOptions());
  ASSERT_TRUE(refined.ok()) << refined.error().message;
  EXPECT_EQ(refined->certificate.prior_sigma_mm, 0.04);
  EXPECT_LT(refined->certificate.sigma_mm, 0.04);
  EXPECT_LT(refined->certificate.correction_mm, -0.01);
  for (const std::size_t left_out : {std::size_t{0}, std::size_t{12}}) {
    const PlacementErrors& errors = refined->placements[left_out];
    EXPECT_NEAR(errors.left_out_mm, WithoutIt(bar, all, left_out), 0.0001);
    EXPECT_LT(std::abs(errors.misfit_sigmas), 4);
    EXPECT_GT(errors.left_out_sigma_mm, 0.01);  // the certificate's is in it
    EXPECT_LT(errors.left_out_sigma_mm, 0.04);
  }
}

TEST(RefineCalibration, ACertificateWithoutUncertaintyIsNotCorrected) {
  const BallBar bar{kBarMm, 0, 0};
  const auto refined = RefineCalibration(Written(), bar, MeasuredBar(Written(), kBarMm, 0.001), BarOptions());
  ASSERT_TRUE(refined.ok()) << refined.error().message;
  EXPECT_EQ(refined->certificate.correction_mm, 0);
  EXPECT_EQ(refined->certificate.sigma_mm, 0);
}

TEST(RefineCalibration, TheProjectorFollows) {
  const auto refined = RefineCalibration(Written(), kBar, MeasuredBar(Written(), kBarMm, 0), BarOptions());
  ASSERT_TRUE(refined.ok() && refined->projector);
  EXPECT_GT(refined->projector->rms_before_px, 0.05);
  EXPECT_LT(refined->projector->rms_px, 0.01);
  StereoCalibration blind = Written();
  blind.projector.reset();
  const auto without = RefineCalibration(blind, kBar, MeasuredBar(blind, kBarMm, 0), BarOptions());
  ASSERT_TRUE(without.ok()) << without.error().message;
  EXPECT_FALSE(without->projector || without->calibration.projector);
}

TEST(RefineCalibration, TellsTheMotionOfTheCamerasFrame) {
  const auto refined = RefineCalibration(Written(), kBar, MeasuredBar(Written(), kBarMm, 0), BarOptions());
  ASSERT_TRUE(refined.ok()) << refined.error().message;
  const RigGeometry before(Written()), after(refined->calibration);
  for (const auto& place : BarPlaces(100)) {
    const auto moved = after.Triangulated(before.Seen(place));
    EXPECT_LT((refined->refined_from_present * place[0] - moved[0]).norm(), 0.1);  // mm; what is not rigid
  }
}

TEST(RefineCalibration, AWrongPlacementIsNamed) {
  std::vector<BarPlacement> placements = MeasuredBar(Written(), kBarMm, 0.001);
  placements[6].center_in_camera[0].y() += 0.05;
  EXPECT_THAT(Refusal(placements, BarOptions(), ErrorCode::kUntrusted),
              HasSubstr("placement P7 does not fit"));
}

TEST(RefineCalibration, ScatterBeyondWhatIsStatedIsRefused) {
  RefinementOptions options = BarOptions();
  options.max_misfit_sigmas = 100;
  std::vector<BarPlacement> placements = MeasuredBar(Written(), kBarMm, 0.01);
  EXPECT_THAT(Refusal(placements, options, ErrorCode::kUntrusted), HasSubstr("chi-square"));
}

TEST(RefineCalibration, ACorrectionBeyondItsPriorIsRefused) {
  RefinementOptions options = BarOptions();
  options.max_prior_sigmas = 0.5;
  EXPECT_THAT(Refusal(MeasuredBar(Written(), kBarMm, 0), options, ErrorCode::kUntrusted),
              HasSubstr("of its prior standard deviations, allowed 0.5"));
}

TEST(RefineCalibration, PlacementsThatDoNotSpanTheVolumeAreRefused) {
  const std::vector<BarPlacement> all = MeasuredBar(Written(), kBarMm, 0);
  const std::vector<BarPlacement> few(all.begin(), all.begin() + 7);
  EXPECT_THAT(Refusal(few, BarOptions(), ErrorCode::kDegenerate), HasSubstr("7 placements, at least 8"));
  const std::vector<BarPlacement> flat(all.begin(), all.begin() + 8);
  EXPECT_THAT(Refusal(flat, BarOptions(), ErrorCode::kDegenerate),
              HasSubstr("do not span the volume along z"));
  const std::vector<BarPlacement> level(all.begin(), all.begin() + 12);
  EXPECT_THAT(Refusal(level, BarOptions(), ErrorCode::kDegenerate),
              HasSubstr("0 of the placements run along z"));
  RefinementOptions wide = BarOptions();
  wide.placements.volume_mm.x() = 600;
  EXPECT_THAT(Refusal(all, wide, ErrorCode::kDegenerate), HasSubstr("do not span the volume along x"));
}

TEST(RefineCalibration, OnePlaceMeasuredTwiceIsRefused) {
  std::vector<BarPlacement> placements = MeasuredBar(Written(), kBarMm, 0.001);
  BarPlacement repeat = placements[4];
  repeat.name = "again";
  std::swap(repeat.center_in_camera[0], repeat.center_in_camera[1]);
  for (Eigen::Vector3d& center : repeat.center_in_camera) center.z() += 15;
  placements.push_back(repeat);
  EXPECT_THAT(Refusal(placements, BarOptions(), ErrorCode::kDegenerate),
              HasSubstr("placements P5 and again are one place"));
  std::swap(placements.back().center_in_camera[0], placements.back().center_in_camera[1]);
  EXPECT_THAT(Refusal(placements, BarOptions(), ErrorCode::kDegenerate), HasSubstr("are one place"));
}

TEST(RefineCalibration, WrongInputIsNamedAndTheNextWorks) {
  const std::vector<BarPlacement> good = MeasuredBar(Written(), kBarMm, 0);
  std::vector<BarPlacement> bad = good;
  bad[2].center_in_camera[1].x() = std::nan("");
  EXPECT_THAT(Refusal(bad, BarOptions(), ErrorCode::kInvalidArgument), HasSubstr("placement P3: ball 2"));
  bad = good;
  bad[4].center_in_camera[0].x() += 900;
  EXPECT_THAT(Refusal(bad, BarOptions(), ErrorCode::kInvalidArgument), HasSubstr("placement P5: ball 1"));
  bad = good;
  bad[4].center_in_camera[0] = bad[4].center_in_camera[1];
  EXPECT_THAT(Refusal(bad, BarOptions(), ErrorCode::kInvalidArgument), HasSubstr("another bar"));
  bad = good;
  bad[1].name = "P1";
  EXPECT_THAT(Refusal(bad, BarOptions(), ErrorCode::kInvalidArgument), HasSubstr("called P1"));
  bad = good;
  bad[0].center_sigma_mm = 0;
  EXPECT_THAT(Refusal(bad, BarOptions(), ErrorCode::kInvalidArgument), HasSubstr("standard deviation"));
  RefinementOptions options = BarOptions();
  options.prior.focal_px = -1;
  EXPECT_THAT(Refusal(good, options, ErrorCode::kInvalidArgument), HasSubstr("left fx is -1"));
  options.prior = {0, 0, 0, 0, 0};
  EXPECT_THAT(Refusal(good, options, ErrorCode::kInvalidArgument), HasSubstr("nothing that may be refined"));
  EXPECT_TRUE(RefineCalibration(Written(), kBar, good, BarOptions()).ok());
}

}  // namespace
}  // namespace forgescan
