// Random starts, 10 mm and 3 degrees off: every one must reach the pose. The full series, 200 starts each,
// takes a minute or two: convergence_test --gtest_also_run_disabled_tests --gtest_filter=*TwoHundred*
#include <gtest/gtest.h>

#include <algorithm>

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
          Moved(ScanOf(*bundle_, {series.points, series.foreign_share, kNoiseMm, seed}), scan_from_model);
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
