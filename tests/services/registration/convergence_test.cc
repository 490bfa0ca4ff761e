// Random starts, 10 mm and 3 degrees off: every one must reach the pose. The full series, 200 starts each,
// takes a minute or two: convergence_test --gtest_also_run_disabled_tests --gtest_filter=*TwoHundred*
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <random>

#include "services/registration/icp.h"
#include "services/registration/paper_icp.h"
#include "services/registration/rival_poses.h"
#include "tests/common/shapes/test_axle.h"

namespace forgescan {
namespace {

using testing::Moved;
using testing::RandomMotion;
using testing::ScanOf;

constexpr double kThreeDegrees = 0.0524;
constexpr double kNoiseMm = 0.03;
constexpr double kNormalNoise = 0.07;  // 4 degrees: 0.03 mm of noise in a window of 7 x 7 pixels

constexpr double kWarpMm = 0.3;

// A part that came out otherwise than designed: every face bulges in or out by up to kWarpMm along its
// normal, and a flash 3 mm high, half a millimetre of it each side of the parting plane, along the beam.
PointCloud Warped(PointCloud scan, double normal_noise_rad) {
  for (std::size_t i = 0; i < scan.size(); ++i) {
    Eigen::Vector3f& p = scan.points[i];
    const double bulge = std::sin(p.x() / 170 + 0.4) * std::cos(p.y() / 60 - 0.3) * std::cos(p.z() / 50);
    p += static_cast<float>(kWarpMm * bulge) * scan.normals[i];
  }
  std::mt19937_64 random(77);
  std::uniform_real_distribution<float> u(0, 1);
  std::normal_distribution<float> tilt(0, static_cast<float>(normal_noise_rad));
  for (int i = 0; i < 1'500; ++i) {
    const float y_side = u(random) < 0.5F ? -1.0F : 1.0F, z_side = u(random) < 0.5F ? -1.0F : 1.0F;
    const float x = 1600 * u(random) - 800, height = 3 * u(random), a = tilt(random), b = tilt(random);
    scan.points.emplace_back(x, y_side * (35 + height), 0.5F * z_side);
    scan.normals.push_back(Eigen::Vector3f(a, b, z_side).normalized());
  }
  return scan;
}

class ConvergenceTest : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    auto bundle = testing::MakeAxle({}, 4);
    ASSERT_TRUE(bundle.ok()) << bundle.error().message;
    bundle_ = new ModelBundle(std::move(*bundle));
    auto model = RegistrationModel::Build(*bundle_);
    ASSERT_TRUE(model.ok()) << model.error().message;
    model_ = new RegistrationModel(std::move(model).value());
  }
  static void TearDownTestSuite() {
    delete model_;
    delete bundle_;
  }

  struct Series {
    std::uint64_t seeds;
    double foreign_share;
    std::size_t points;
    double within_mm;  // of the worst corner of the model's box
  };
  void RunSeries(const Series& series) {
    std::vector<double> worst;
    for (std::uint64_t seed = 1; seed <= series.seeds; ++seed) {
      const Eigen::Isometry3d scan_from_model =
          RandomMotion(Eigen::Vector3d::Zero(), kThreeDegrees, 10, 1000 + seed);
      const PointCloud scan =
          Moved(ScanOf(*bundle_, {series.points, series.foreign_share, kNoiseMm, seed, true, kNormalNoise}),
                scan_from_model);
      const auto result = RegisterScan(scan, *model_, Eigen::Isometry3d::Identity(), {});
      ASSERT_TRUE(result.ok()) << "seed " << seed << ": " << result.error().message;
      worst.push_back(CornerMotionMm(result->model_from_scan * scan_from_model, *model_));
      EXPECT_LT(worst.back(), series.within_mm) << "seed " << seed;
      EXPECT_NEAR(result->rms_mm, kNoiseMm, 0.2 * kNoiseMm);  // the biweight takes a little off it
    }
    std::sort(worst.begin(), worst.end());
    std::printf("%zu starts, %.0f %% foreign: worst corner median %.4f mm, largest %.4f mm, limit %.3f mm\n",
                worst.size(), 100 * series.foreign_share, worst[worst.size() / 2], worst.back(),
                series.within_mm);
  }

  // Registers the warped part from so many starts. What its true pose is, is a matter of definition; that all
  // starts end at one pose is not.
  void RunWarped(std::uint64_t starts) {
    const PointCloud part =
        Warped(ScanOf(*bundle_, {30'000, 0.22, kNoiseMm, 1, true, kNormalNoise}), kNormalNoise);
    std::optional<Eigen::Isometry3d> first;  // model_from_part
    double apart_mm = 0;
    for (std::uint64_t seed = 1; seed <= starts; ++seed) {
      const Eigen::Isometry3d scan_from_part =
          RandomMotion(Eigen::Vector3d::Zero(), kThreeDegrees, 10, 1000 + seed);
      const auto result =
          RegisterScan(Moved(part, scan_from_part), *model_, Eigen::Isometry3d::Identity(), {});
      ASSERT_TRUE(result.ok()) << "seed " << seed << ": " << result.error().message;
      const Eigen::Isometry3d model_from_part = result->model_from_scan * scan_from_part;
      if (!first) first = model_from_part;
      const double off_mm = CornerMotionMm(model_from_part * first->inverse(), *model_);
      EXPECT_LT(off_mm, 0.01) << "seed " << seed;  // five times where the last steps may stop
      apart_mm = std::max(apart_mm, off_mm);
    }
    std::printf(
        "%d starts of the warped part end within %.4f mm of each other, %.3f mm from the model's pose\n",
        static_cast<int>(starts), apart_mm, CornerMotionMm(*first, *model_));
    EXPECT_LT(CornerMotionMm(*first, *model_), kWarpMm);  // no farther than the part deviates
  }

  static ModelBundle* bundle_;
  static RegistrationModel* model_;
};
ModelBundle* ConvergenceTest::bundle_ = nullptr;
RegistrationModel* ConvergenceTest::model_ = nullptr;

TEST_F(ConvergenceTest, Starts) { ASSERT_NE(model_, nullptr); }

// The limits are the goals; 0.03 mm of noise on 30,000 points alone gives 0.001 to 0.004 mm.
TEST_F(ConvergenceTest, ReachesThePoseFromRandomStarts) { RunSeries({12, 0.22, 60'000, 0.01}); }
TEST_F(ConvergenceTest, ReachesThePoseAmongMoreForeignPoints) { RunSeries({12, 0.35, 60'000, 0.02}); }
TEST_F(ConvergenceTest, DISABLED_TwoHundredStartsAt22Percent) { RunSeries({200, 0.22, 60'000, 0.01}); }
TEST_F(ConvergenceTest, DISABLED_TwoHundredStartsAt35Percent) { RunSeries({200, 0.35, 60'000, 0.02}); }

TEST_F(ConvergenceTest, AWarpedPartEndsAtOnePoseFromAllStarts) { RunWarped(12); }
TEST_F(ConvergenceTest, DISABLED_TwoHundredStartsOfAWarpedPart) { RunWarped(200); }

// The paper's algorithm as it is written, from the start a calibrated station gives: both must tell of one
// pose. It pairs with samples 4 mm apart, and foreign points among the nearest 70 % pull at it.
TEST_F(ConvergenceTest, AgreesWithThePaperOnAScanWithoutForeignPoints) {
  const Eigen::Isometry3d scan_from_model = RandomMotion(Eigen::Vector3d::Zero(), 0.005, 2, 5);
  const PointCloud scan = Moved(ScanOf(*bundle_, {20'000, 0, kNoiseMm, 5}), scan_from_model);
  const SampleTree tree(model_->sample_points());
  const auto paper =
      RegisterAsInPaper(scan, *model_, [&](std::span<const Eigen::Vector3f> q) { return tree.Find(q); },
                        Eigen::Isometry3d::Identity(), {});
  ASSERT_TRUE(paper.ok()) << paper.error().message;
  EXPECT_TRUE(paper->at_rest);
  const auto ours = RegisterScan(scan, *model_, Eigen::Isometry3d::Identity(), {});
  ASSERT_TRUE(ours.ok()) << ours.error().message;
  const double paper_mm = CornerMotionMm(paper->model_from_scan * scan_from_model, *model_);
  const double ours_mm = CornerMotionMm(ours->model_from_scan * scan_from_model, *model_);
  std::printf("worst corner: the paper's %.4f mm after %d steps, ours %.4f mm\n", paper_mm, paper->iterations,
              ours_mm);
  EXPECT_LT(ours_mm, 0.01);
  EXPECT_LT(paper_mm, 0.5);
}

TEST_F(ConvergenceTest, ThePaperRefusesWhatIsNotFinite) {
  PointCloud scan = ScanOf(*bundle_, {1'000, 0, kNoiseMm, 5});
  const SampleTree tree(model_->sample_points());
  const SampleSearch search = [&](std::span<const Eigen::Vector3f> q) { return tree.Find(q); };
  const Eigen::Isometry3d start = Eigen::Isometry3d::Identity();
  scan.points[7].x() = std::nanf("");
  EXPECT_EQ(RegisterAsInPaper(scan, *model_, search, start, {}).error().code, ErrorCode::kInvalidArgument);
  scan.points.resize(5);
  EXPECT_EQ(RegisterAsInPaper(scan, *model_, search, start, {}).error().code, ErrorCode::kDegenerate);
}

}  // namespace
}  // namespace forgescan
