// A real laser scan of a shelf of objects, three quarters of it foreign to the model. The data are public
// research data and not in the repository: see tests/common/real_data.h.
#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <numbers>
#include <random>

#include "services/common/geometry/cloud_io.h"
#include "services/common/model/model_import.h"
#include "services/registration/icp.h"
#include "tests/common/real_data.h"

namespace forgescan {
namespace {

constexpr double kDegree = std::numbers::pi / 180;

// model -> scene as published with the data (point-to-plane, 1 mm gate), mm.
Eigen::Isometry3d KnownSceneFromModel() {
  Eigen::Matrix3d rotation;
  rotation << 0.99436, -0.08686, 0.06085, 0.09937, 0.56271, -0.82066, 0.03704, 0.82208, 0.56817;
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
  pose.linear() = Eigen::Quaterniond(rotation).normalized().toRotationMatrix();
  pose.translation() = Eigen::Vector3d(-74.30975, -601.52190, -292.98355);
  return pose;
}

Eigen::Vector3d RandomDirection(std::mt19937_64& random) {
  std::normal_distribution<double> normal;
  return Eigen::Vector3d(normal(random), normal(random), normal(random)).normalized();
}

Eigen::Vector3d Centroid(const ModelBundle& bundle) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (const auto& v : bundle.vertices) sum += v.cast<double>();
  return sum / static_cast<double>(bundle.vertices.size());
}

// 6 degrees about a random axis through `center` and 6 mm in a random direction off.
Eigen::Isometry3d Disturbance(const Eigen::Vector3d& center, std::mt19937_64& random) {
  const Eigen::AngleAxisd turn(6 * kDegree, RandomDirection(random));
  return Eigen::Translation3d(center + 6 * RandomDirection(random)) * turn * Eigen::Translation3d(-center);
}

TEST(RealClutter, TwentyOfTwentyStartsReachTheKnownPose) {
  const auto found = RealData("real-clutter");
  if (!found.has_value()) GTEST_SKIP() << "real-clutter" << kNoRealData;
  const std::filesystem::path& folder = *found;
  const auto bundle = LoadModel(folder / "parasaurolophus_low_normals2.ply", {});
  ASSERT_TRUE(bundle.ok()) << bundle.error().message;
  const auto model = RegistrationModel::Build(*bundle);
  ASSERT_TRUE(model.ok()) << model.error().message;
  const auto scene = ReadPointCloud(folder / "rs1_normals.ply");
  ASSERT_TRUE(scene.ok()) << scene.error().message;
  const Eigen::Isometry3d known = KnownSceneFromModel();
  const Eigen::Vector3d center = Centroid(*bundle);
  IcpOptions options;
  std::mt19937_64 random(20180213);
  for (int start = 0; start < 20; ++start) {
    const auto result = RegisterScan(*scene, *model, Disturbance(center, random) * known.inverse(), options);
    EXPECT_TRUE(result.ok()) << "start " << start << ": " << (result.ok() ? "" : result.error().message);
    if (!result.ok()) continue;
    const Eigen::Isometry3d error = result->model_from_scan * known;
    // The tolerances are those of the data's own reference pose, whose rms is 0.44 mm.
    EXPECT_LT(Eigen::AngleAxisd(error.linear()).angle(), 0.2 * kDegree) << "start " << start;
    EXPECT_LT((error * center - center).norm(), 0.5) << "start " << start;
    if (std::getenv("FORGESCAN_VERBOSE") != nullptr) {
      std::printf(
          "%2d: %.3f deg %.3f mm, %d iterations, %zu of %zu inliers, threshold %.2f rms %.3f score %.2f "
          "eigen %.3g\n",
          start, Eigen::AngleAxisd(error.linear()).angle() / kDegree, (error * center - center).norm(),
          result->iterations, result->inliers, result->considered, result->threshold_mm, result->rms_mm,
          result->capped_score_mm, result->weakest_eigenvalue);
    }
  }
}

}  // namespace
}  // namespace forgescan
