#include "services/common/features/dimensions.h"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/common/shapes/test_axle.h"

namespace forgescan {
namespace {

using testing::AxleSize;
using testing::MakeAxle;
using testing::ScanOf;
using testing::ScanOptions;

// The last one, the diameter, has an uncertainty of its own.
const std::string kFeatures = testing::AxleFeatures({"total length", "left plate width", "right diameter"}) +
                              "expanded_uncertainty_mm = 0.1\n";

class DimensionsTest : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    auto model = MakeAxle(AxleSize{}, 4);
    ASSERT_TRUE(model.ok()) << model.error().message;
    model_ = new ModelBundle(std::move(*model));
    auto features = ParseFeatures(kFeatures, "features.toml");
    ASSERT_TRUE(features.ok()) << features.error().message;
    auto bound = BindFeatures(*features, *model_);
    ASSERT_TRUE(bound.ok()) << bound.error().message;
    features_ = new Features(*bound);
  }
  static void TearDownTestSuite() {
    delete features_;
    delete model_;
  }
  static std::vector<DimensionResult> Evaluate(const PointCloud& cloud) {
    const auto results = EvaluateDimensions(cloud, *model_, *features_, {});
    EXPECT_TRUE(results.ok()) << (results.ok() ? "" : results.error().message);
    return results.ok() ? *results : std::vector<DimensionResult>(3);
  }

  static ModelBundle* model_;
  static Features* features_;
};
ModelBundle* DimensionsTest::model_ = nullptr;
Features* DimensionsTest::features_ = nullptr;

TEST_F(DimensionsTest, Starts) { ASSERT_NE(features_, nullptr); }

TEST_F(DimensionsTest, NominalSizesComeFromTheModel) {
  const double kRounding = 1e-6;  // mm, of the STEP file's digits
  EXPECT_NEAR(features_->dimensions[0].nominal_mm, 1888.4, kRounding);
  EXPECT_NEAR(features_->dimensions[1].nominal_mm, 178.9, kRounding);
  EXPECT_NEAR(features_->dimensions[2].nominal_mm, 88.5, kRounding);
}

// Another axle than the nominal one is measured; the results are its sizes.
TEST_F(DimensionsTest, MeasuresAPartThatDiffersFromTheModel) {
  AxleSize actual;
  actual.total_length_mm += 0.62;
  actual.left_width_mm -= 0.31;
  actual.right_diameter_mm += 0.24;
  const auto part = MakeAxle(actual, 4);
  ASSERT_TRUE(part.ok());
  const auto results = Evaluate(ScanOf(*part, {150'000, 0.1, 0.03, 11}));
  const double truth[] = {actual.total_length_mm, actual.left_width_mm, actual.right_diameter_mm};
  for (std::size_t i = 0; i < 3; ++i) {
    ASSERT_TRUE(results[i].measured_mm) << results[i].name << ": " << results[i].reason;
    // Five standard uncertainties, and 0.006 mm for the chords of the part's triangles (0.005 mm) and single
    // precision.
    EXPECT_NEAR(*results[i].measured_mm, truth[i], 5 * results[i].standard_uncertainty_mm + 0.006)
        << results[i].name;
    EXPECT_LT(results[i].standard_uncertainty_mm, 0.01) << results[i].name;
    EXPECT_GT(results[i].points, 500U);
    EXPECT_LT(results[i].removed_share, 0.05) << results[i].name;
    EXPECT_EQ(results[i].reason, "");
  }
}

TEST_F(DimensionsTest, SaysWhyADimensionCannotBeDetermined) {
  PointCloud half;  // nothing of the left end, and only the upper third of the right cylinder
  const PointCloud all = ScanOf(*model_, {100'000, 0, 0.03, 12});
  for (std::size_t i = 0; i < all.size(); ++i) {
    const Eigen::Vector3f& p = all.points[i];
    if (p.x() < -900 || (p.x() > 800 && p.z() < 25)) continue;
    half.points.push_back(p);
    half.normals.push_back(all.normals[i]);
  }
  const auto results = Evaluate(half);
  EXPECT_FALSE(results[0].measured_mm);
  EXPECT_NE(results[0].reason.find("left_end_face"), std::string::npos) << results[0].reason;
  EXPECT_TRUE(results[1].measured_mm) << results[1].reason;
  EXPECT_FALSE(results[2].measured_mm);
  EXPECT_NE(results[2].reason.find("radius constrained"), std::string::npos) << results[2].reason;
}

// The radius may stay nominal only because the arc is short; any other trouble keeps its own sentence.
TEST_F(DimensionsTest, ALongArcThatIsNoCylinderSaysSo) {
  PointCloud cloud = ScanOf(*model_, {100'000, 0, 0.03, 14});
  for (Eigen::Vector3f& p : cloud.points) {
    // Oval by 1.5 mm: within reach of the face, but not round.
    if (p.x() > 800 && p.x() < 943) p.z() *= 1 - 1.5F / 44.25F;
  }
  const auto results = Evaluate(cloud);
  EXPECT_FALSE(results[2].measured_mm);
  EXPECT_EQ(results[2].reason.find("arc"), std::string::npos) << results[2].reason;
  EXPECT_NE(results[2].reason.find("another shape"), std::string::npos) << results[2].reason;
}

TEST_F(DimensionsTest, PlatesThatAreNotParallelHaveNoWidth) {
  PointCloud cloud = ScanOf(*model_, {100'000, 0, 0.03, 13});
  for (std::size_t i = 0; i < cloud.size(); ++i) {
    // The front face leans by 0.7 degrees.
    if (cloud.normals[i].y() > 0.9F)
      cloud.points[i].y() += 0.0122F * (cloud.points[i].x() + 500) * (cloud.points[i].x() < 0);
  }
  const auto results = Evaluate(cloud);
  EXPECT_FALSE(results[1].measured_mm);
  EXPECT_NE(results[1].reason.find("parallel"), std::string::npos) << results[1].reason;
}

TEST_F(DimensionsTest, AnEmptyCloudGivesReasonsNotNumbers) {
  for (const DimensionResult& result : Evaluate({})) {
    EXPECT_FALSE(result.measured_mm);
    EXPECT_FALSE(result.reason.empty());
  }
}

TEST_F(DimensionsTest, PointsNearABorderBelongToNoFace) {
  const auto face = FindFace(*model_, "left_plate_front");
  ASSERT_TRUE(face.ok());
  PointCloud cloud;
  const float y = 178.9F / 2;
  for (const float z : {26.0F, 28.0F, 42.0F, 59.0F})
    cloud.points.emplace_back(-500.0F, y + 0.2F, z);  // face: z 25..60
  const auto selector = FaceSelector::Build(*model_, {*face});
  ASSERT_TRUE(selector.ok());
  const auto selected = selector->Select(cloud, {});
  ASSERT_TRUE(selected.ok());
  EXPECT_EQ(selected->points[0].size(), 2U);
}

}  // namespace
}  // namespace forgescan
