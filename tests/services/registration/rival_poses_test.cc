// Poses that cannot be told apart must be refused, and only those.
#include "services/registration/rival_poses.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <random>

#include "services/common/model/model_import.h"
#include "services/registration/icp.h"
#include "tests/common/shapes/test_axle.h"

namespace forgescan {
namespace {

using testing::Moved;
using testing::RandomMotion;
using testing::ScanOf;

constexpr float kPitchMm = 9;
constexpr double kThreeDegrees = 0.0524;

void AddBox(TriangleMesh& mesh, const Eigen::Vector3f& low, const Eigen::Vector3f& high) {
  const auto first = static_cast<std::uint32_t>(mesh.vertices.size());
  for (int corner = 0; corner < 8; ++corner) {
    const auto at = [&](int axis) { return (corner >> axis & 1) != 0 ? high[axis] : low[axis]; };
    mesh.vertices.emplace_back(at(0), at(1), at(2));
  }
  for (const auto& [a, b, c, d] : {std::array{0U, 2U, 3U, 1U},
                                   {4U, 5U, 7U, 6U},
                                   {0U, 1U, 5U, 4U},
                                   {2U, 6U, 7U, 3U},
                                   {0U, 4U, 6U, 2U},
                                   {1U, 3U, 7U, 5U}}) {
    mesh.triangles.push_back({first + a, first + b, first + c});
    mesh.triangles.push_back({first + a, first + c, first + d});
  }
}

// Height of the rack's top at x: waves of 1.2 mm. The wave in the middle stands 0.4 mm higher: all that tells
// a pose from the one a pitch away, where the ends are not seen.
float TopMm(float x) {
  const float wave = std::cos(2 * std::numbers::pi_v<float> * x / kPitchMm);
  return wave * (std::abs(x) < kPitchMm / 4 ? 1.6F : 1.2F);
}

// A bar of 300 x 40 x 30 mm with waves along its top.
TriangleMesh Rack() {
  TriangleMesh mesh;
  constexpr float kStepMm = 0.5F;
  constexpr std::uint32_t kSteps = 600;
  for (std::uint32_t i = 0; i <= kSteps; ++i) {
    const float x = kStepMm * static_cast<float>(i) - 150;
    for (const auto& [y, z] :
         {std::pair{-20.0F, -30.0F}, {20.0F, -30.0F}, {20.0F, TopMm(x)}, {-20.0F, TopMm(x)}}) {
      mesh.vertices.emplace_back(x, y, z);
    }
  }
  for (std::uint32_t i = 0; i < kSteps; ++i) {
    for (std::uint32_t side = 0; side < 4; ++side) {
      const std::uint32_t a = 4 * i + side, b = 4 * i + (side + 1) % 4;
      mesh.triangles.push_back({a, b, b + 4});
      mesh.triangles.push_back({a, b + 4, a + 4});
    }
  }
  const std::uint32_t last = 4 * kSteps;
  for (const auto& t :
       {TriangleCorners{0, 2, 1}, {0, 3, 2}, {last, last + 1, last + 2}, {last, last + 2, last + 3}}) {
    mesh.triangles.push_back(t);
  }
  return mesh;
}

// What is seen from above and the sides of the rack's middle, eight waves to either side.
PointCloud MiddleOf(const ModelBundle& rack, std::uint64_t seed) {
  const PointCloud all = ScanOf(rack, {60'000, 0, 0.03, seed});
  PointCloud middle;
  for (std::size_t i = 0; i < all.size(); ++i) {
    const Eigen::Vector3f& p = all.points[i];
    if (std::abs(p.x()) > 8 * kPitchMm || p.z() < -29) continue;
    middle.points.push_back(p);
    middle.normals.push_back(all.normals[i]);
  }
  return middle;
}

struct Part {
  ModelBundle bundle;
  RegistrationModel model;
};

Result<Part> Prepare(Result<ModelBundle> bundle) {
  RETURN_IF_ERROR(bundle.ok() ? Status() : Status(bundle.error()));
  ASSIGN_OR_RETURN(RegistrationModel model, RegistrationModel::Build(*bundle));
  return Part{std::move(*bundle), std::move(model)};
}

class RivalPosesTest : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    auto rack = Prepare(ModelFromMesh(Rack(), 2));
    auto axle = Prepare(testing::MakeAxle({}, 4));
    ASSERT_TRUE(rack.ok() && axle.ok());
    rack_ = new Part(std::move(*rack));
    axle_ = new Part(std::move(*axle));
  }
  static void TearDownTestSuite() {
    delete rack_;
    delete axle_;
  }

  // Of `seeds` scans of the rack's middle, those refused as ambiguous.
  static int AmbiguousRacks(int seeds) {
    int refused = 0;
    for (int seed = 1; seed <= seeds; ++seed) {
      const auto id = static_cast<std::uint64_t>(seed);
      const PointCloud scan =
          Moved(MiddleOf(rack_->bundle, id), RandomMotion(Eigen::Vector3d::Zero(), kThreeDegrees, 8, id));
      const auto result = RegisterScan(scan, rack_->model, Eigen::Isometry3d::Identity(), {});
      const bool ambiguous = !result.ok() && result.error().code == ErrorCode::kUntrusted &&
                             result.error().message.find("ambiguous") != std::string::npos;
      refused += ambiguous ? 1 : 0;
      if (!ambiguous) {
        std::printf("seed %d: %s\n", seed,
                    result.ok() ? fmt::format("accepted, ratio {}", result->rival_ratio).c_str()
                                : result.error().message.c_str());
      }
    }
    return refused;
  }
  // Of `seeds` scans of the axle, those with a pose; the smallest ratio seen goes to stdout.
  static int AcceptedAxles(int seeds) {
    int accepted = 0;
    double smallest = std::numeric_limits<double>::infinity();
    for (int seed = 1; seed <= seeds; ++seed) {
      const auto id = static_cast<std::uint64_t>(seed);
      const PointCloud scan = Moved(ScanOf(axle_->bundle, {30'000, seed % 2 == 0 ? 0.22 : 0.35, 0.03, id}),
                                    RandomMotion(Eigen::Vector3d::Zero(), kThreeDegrees, 10, id));
      const auto result = RegisterScan(scan, axle_->model, Eigen::Isometry3d::Identity(), {});
      EXPECT_TRUE(result.ok()) << "seed " << seed << ": " << (result.ok() ? "" : result.error().message);
      if (!result.ok()) continue;
      ++accepted;
      smallest = std::min(smallest, result->rival_ratio);
    }
    std::printf("smallest ratio of a rival's score: %.2f\n", smallest);
    return accepted;
  }

  static Part *rack_, *axle_;
};
Part* RivalPosesTest::rack_ = nullptr;
Part* RivalPosesTest::axle_ = nullptr;

TEST_F(RivalPosesTest, Starts) { ASSERT_NE(rack_, nullptr); }

TEST_F(RivalPosesTest, APoseAPitchAwayIsReported) { EXPECT_EQ(AmbiguousRacks(8), 8); }
TEST_F(RivalPosesTest, DISABLED_TwoHundredRacks) { EXPECT_GE(AmbiguousRacks(200), 198); }
TEST_F(RivalPosesTest, ThePlainAxleIsNotRefused) { EXPECT_EQ(AcceptedAxles(8), 8); }
TEST_F(RivalPosesTest, DISABLED_TwoHundredAxles) { EXPECT_EQ(AcceptedAxles(200), 200); }

// With its ends in sight the rack has one pose only.
TEST_F(RivalPosesTest, TheWholeRackIsNotRefused) {
  const Eigen::Isometry3d scan_from_model = RandomMotion(Eigen::Vector3d::Zero(), 0.02, 2, 3);
  const PointCloud scan = Moved(ScanOf(rack_->bundle, {40'000, 0, 0.03, 3}), scan_from_model);
  const auto result = RegisterScan(scan, rack_->model, Eigen::Isometry3d::Identity(), {});
  ASSERT_TRUE(result.ok()) << result.error().message;
  EXPECT_LT(CornerMotionMm(result->model_from_scan * scan_from_model, rack_->model),
            0.05);  // mm, far below a pitch
  EXPECT_GT(result->rival_ratio, 1.5);
}

TEST_F(RivalPosesTest, TheCheckCanBeSwitchedOff) {
  IcpOptions options;
  options.rival_ratio = 0;
  const PointCloud scan = MiddleOf(rack_->bundle, 1);
  EXPECT_TRUE(RegisterScan(scan, rack_->model, Eigen::Isometry3d::Identity(), options).ok());
  EXPECT_FALSE(RegisterScan(scan, rack_->model, Eigen::Isometry3d::Identity(), {}).ok());
}

// End for end, the axle nearly fits: its plates and cylinders differ by 1.5 and 1.2 mm.
TEST_F(RivalPosesTest, AReversedAxleIsReported) {
  const Eigen::Isometry3d reversed = HalfTurn(axle_->model, 2);
  EXPECT_FALSE(IsSymmetry(axle_->model, reversed));
  EXPECT_FALSE(axle_->model.IsSymmetricAbout(2));
  for (const std::uint64_t seed : {1U, 2U, 3U}) {
    const PointCloud scan = Moved(ScanOf(axle_->bundle, {30'000, 0.22, 0.03, seed}), reversed);
    const auto result = RegisterScan(scan, axle_->model, Eigen::Isometry3d::Identity(), {});
    ASSERT_FALSE(result.ok());
    EXPECT_EQ(result.error().code, ErrorCode::kUntrusted);
    EXPECT_NE(result.error().message.find("turned"), std::string::npos) << result.error().message;
  }
}

// A half turn that maps the part onto itself is no other pose.
TEST_F(RivalPosesTest, ASymmetricPartIsNotRefused) {
  TriangleMesh mesh;
  AddBox(mesh, {-60, -40, -25}, {60, 40, 25});
  const auto box = Prepare(ModelFromMesh(mesh, 2));
  ASSERT_TRUE(box.ok());
  for (int axis = 0; axis < 3; ++axis) {
    EXPECT_TRUE(IsSymmetry(box->model, HalfTurn(box->model, axis)));
    EXPECT_TRUE(box->model.IsSymmetricAbout(axis));
  }
  const Eigen::Isometry3d scan_from_model = RandomMotion(Eigen::Vector3d::Zero(), kThreeDegrees, 8, 4);
  const PointCloud scan = Moved(ScanOf(box->bundle, {20'000, 0, 0.03, 4}), scan_from_model);
  const auto result = RegisterScan(scan, box->model, Eigen::Isometry3d::Identity(), {});
  ASSERT_TRUE(result.ok()) << result.error().message;
  EXPECT_LT(CornerMotionMm(result->model_from_scan * scan_from_model, box->model), 0.01);  // mm
}

// An axle with two ends alike: its half turn maps facets of the cylinders onto others, and a shift along the
// axle is found and taken back, as far as it is allowed.
TEST_F(RivalPosesTest, ASymmetryIsFoundFromNearby) {
  testing::AxleSize size;
  size.left_width_mm = size.right_width_mm = 178;
  size.left_diameter_mm = size.right_diameter_mm = 89;
  const auto axle = Prepare(testing::MakeAxle(size, 4));
  ASSERT_TRUE(axle.ok());
  const Eigen::Isometry3d turn = HalfTurn(axle->model, 2);
  EXPECT_TRUE(IsSymmetry(axle->model, turn));
  EXPECT_TRUE(axle->model.IsSymmetricAbout(2));
  EXPECT_FALSE(axle->model.IsSymmetricAbout(0));
  const Eigen::Isometry3d near = RandomMotion(axle->model.center(), 5e-4, 0.3, 1) * turn;
  EXPECT_FALSE(IsSymmetry(axle->model, near));
  EXPECT_TRUE(IsNearSymmetry(axle->model, near, 2));
  EXPECT_FALSE(IsNearSymmetry(axle->model, near, 0.2));
  EXPECT_FALSE(IsNearSymmetry(axle->model, HalfTurn(axle->model, 0), 2));
  EXPECT_FALSE(IsNearSymmetry(axle_->model, HalfTurn(axle_->model, 2), 2));
}

// Without its waves and ends the rack can slide: the motion has a name.
TEST_F(RivalPosesTest, TheDirectionThatIsNotHeldIsNamed) {
  const PointCloud all = ScanOf(rack_->bundle, {40'000, 0, 0.03, 9});
  PointCloud sides;
  for (std::size_t i = 0; i < all.size(); ++i) {
    if (all.points[i].z() > -3 || std::abs(all.normals[i].x()) > 0.5F) continue;
    sides.points.push_back(all.points[i]);
    sides.normals.push_back(all.normals[i]);
  }
  const auto result = RegisterScan(sides, rack_->model, Eigen::Isometry3d::Identity(), {});
  ASSERT_FALSE(result.ok());
  EXPECT_EQ(result.error().code, ErrorCode::kDegenerate);
  EXPECT_NE(result.error().message.find("translation along x"), std::string::npos) << result.error().message;
}

TEST_F(RivalPosesTest, WeakDirectionsAreListed) {
  IcpOptions options;
  options.weak_eigenvalue = 1.0 / 3;  // all that are not as well held as they can be
  const auto result = RegisterScan(ScanOf(axle_->bundle, {20'000, 0, 0.03, 9}), axle_->model,
                                   Eigen::Isometry3d::Identity(), options);
  ASSERT_TRUE(result.ok()) << result.error().message;
  ASSERT_FALSE(result->weak_directions.empty());
  EXPECT_EQ(result->weak_directions[0].eigenvalue, result->weakest_eigenvalue);
  for (const auto& weak : result->weak_directions)
    std::printf("%s: %.4f\n", weak.name.c_str(), weak.eigenvalue);
}

}  // namespace
}  // namespace forgescan
