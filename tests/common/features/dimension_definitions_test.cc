// Definitions of a size beside the usual ones: two-point sizes, short arcs, ends that are not plane.
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>

#include "services/common/features/dimensions.h"
#include "services/common/features/two_point.h"
#include "tests/common/shapes/test_axle.h"

namespace forgescan {
namespace {

using testing::AxleSize;

constexpr const char* kHead = R"(
part = "axle"
reference_temperature_degc = 900.0
)";
constexpr const char* kLength = R"(
[[dimension]]
name = "total length"
type = "length"
faces = ["left_end_face", "right_end_face"]
datum = ["left_cylinder", "right_cylinder"]
lower_mm = 1887.4
upper_mm = 1889.4
)";

constexpr const char* kDiameter = R"(
[[dimension]]
name = "right diameter"
type = "diameter"
faces = ["right_cylinder"]
lower_mm = 88.0
upper_mm = 89.0
)";

std::string Diameter(const std::string& more) { return fmt::format("{}{}", kDiameter, more); }

class DefinitionsTest : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    auto model = testing::MakeAxle({}, 4);
    ASSERT_TRUE(model.ok());
    model_ = new ModelBundle(std::move(*model));
  }
  static void TearDownTestSuite() { delete model_; }

  static DimensionResult Measure(const PointCloud& cloud, const std::string& dimension,
                                 const DimensionOptions& options = {}) {
    auto features = ParseFeatures(fmt::format("{}{}", kHead, dimension), "features.toml");
    EXPECT_TRUE(features.ok()) << features.error().message;
    auto bound = BindFeatures(*features, *model_);
    EXPECT_TRUE(bound.ok()) << bound.error().message;
    const auto results = EvaluateDimensions(cloud, *model_, *bound, options);
    EXPECT_TRUE(results.ok());
    return results.ok() ? results->front() : DimensionResult{};
  }

  // Places along the right cylinder, in the direction its nominal axis has.
  static std::string Sections() {
    const auto face = FindFace(*model_, "right_cylinder");
    const double sign = model_->faces[*face].direction.x() < 0 ? 1 : -1;
    const double end = model_->faces[*face].point.x();
    std::string text = "sections_mm = [";
    for (const double x : {840.0, 880.0, 920.0}) text += fmt::format("{:.3f}, ", sign * (end - x));
    return fmt::format("{}]\n", text);
  }

  // The right cylinder alone, oval: its radius grows by oval_mm across y and shrinks by it across z. Between
  // the angles given, from the y axis.
  static PointCloud Oval(double oval_mm, double from_deg, double to_deg) {
    std::mt19937_64 random(8);
    std::uniform_real_distribution<double> along(815, 944), turn(from_deg, to_deg);
    std::normal_distribution<double> noise(0, 0.01);
    PointCloud cloud;
    for (int i = 0; i < 80'000; ++i) {
      const double angle = turn(random) * std::numbers::pi / 180;
      const double radius = 88.5 / 2 + oval_mm * std::cos(2 * angle) + noise(random);
      const Eigen::Vector3d out(0, std::cos(angle), std::sin(angle));
      cloud.points.push_back((along(random) * Eigen::Vector3d::UnitX() + radius * out).cast<float>());
      cloud.normals.push_back(out.cast<float>());
    }
    return cloud;
  }

  static ModelBundle* model_;
};
ModelBundle* DefinitionsTest::model_ = nullptr;

TEST_F(DefinitionsTest, Starts) { EXPECT_TRUE(Measure(Oval(0, 0, 360), Diameter("")).measured_mm); }

TEST_F(DefinitionsTest, TwoPointSizesOfAnOvalCylinder) {
  const PointCloud oval = Oval(0.2, 0, 360);
  // A patch of some 20 points is known to 0.003 mm, the largest of 135 sizes lies three of them too far out.
  const double kPatches = 0.015;
  const auto gg = Measure(oval, Diameter(""));
  ASSERT_TRUE(gg.measured_mm) << gg.reason;
  EXPECT_NEAR(*gg.measured_mm, 88.5, 0.003);  // mm: noise of 80,000 points 0.0002, single precision
  EXPECT_EQ(gg.definition.find("GG"), 0U) << gg.definition;
  EXPECT_NEAR(gg.form_range_mm, 0.47, 0.05);  // 0.4, and the noise, three to four of it on both sides
  const std::pair<const char*, double> kRanks[] = {{"LP max", 88.9}, {"LP min", 88.1}, {"LP mean", 88.5}};
  for (const auto& [name, size_mm] : kRanks) {
    const auto lp = Measure(oval, Diameter(fmt::format("definition = \"{}\"\n{}", name, Sections())));
    ASSERT_TRUE(lp.measured_mm) << name << ": " << lp.reason;
    EXPECT_NEAR(*lp.measured_mm, size_mm, kPatches) << name;
    EXPECT_EQ(lp.definition.find(name), 0U) << lp.definition;
    EXPECT_EQ(lp.reason, "");
    EXPECT_LT(lp.standard_uncertainty_mm, 0.05);
    // 135 sizes, 3.1 mm apart around the section, and patches of 12 mm.
    const double is_chosen = std::string(name) == "LP mean" ? 0 : 1;
    EXPECT_NEAR(lp.influence.extreme.scatter, is_chosen * std::sqrt(2 * std::log(135)), 0.001) << name;
    EXPECT_NEAR(lp.influence.extreme.patch, is_chosen * std::sqrt(2 * std::log(135 * 3.09 / 12)), 0.001)
        << name;
  }
}

// Three sizes within one patch of 12 mm: points of their own, but one error of the patch for all.
TEST(TwoPointTest, NeighboursShareTheirPatchButNotTheirPoints) {
  TwoPointSizes found;
  found.sizes.resize(3);
  const double kRounding = 1e-12;
  EXPECT_NEAR(ExpectedExtreme(found, 44.25, 12).scatter, std::sqrt(2 * std::log(3)), kRounding);
  EXPECT_EQ(ExpectedExtreme(found, 44.25, 12).patch, 0);
  EXPECT_NEAR(ExpectedExtreme(found, 44.25, 1).patch, std::sqrt(2 * std::log(3)), kRounding);
  found.sizes.clear();
  EXPECT_EQ(ExpectedExtreme(found, 44.25, 1).scatter, 0);
}

// Two patches of three points, 1 mm apart and each uneven by 0.03 mm: 4 degrees of freedom.
TEST(TwoPointTest, NoiseIsThatWithinThePatches) {
  CylinderFit cylinder;
  cylinder.axis = Eigen::Vector3d::UnitX();
  cylinder.radius_mm = 44;
  std::vector<Eigen::Vector3d> points;
  for (const double off : {-0.03, 0.0, 0.03}) points.emplace_back(0, 44 + off, 0);
  for (const double off : {-0.03, 0.0, 0.03}) points.emplace_back(0, -45 - off, 0);
  const std::vector<TwoPointSize> sizes = {{89, 0, {0, 1, 2}, {3, 4, 5}}};
  EXPECT_NEAR(TwoPointNoise(points, cylinder, sizes), 4 * 0.03 * 0.03 / 4, 1e-12);  // mm^2, rounding
  EXPECT_EQ(TwoPointNoise(points, cylinder, {}), 0);
}

// Seen from above only, opposite points are rare: the size is told, with the share of directions.
TEST_F(DefinitionsTest, TwoPointSizesSayHowMuchWasSeen) {
  const auto lp =
      Measure(Oval(0, -30, 210), Diameter(fmt::format("definition = \"LP max\"\n{}", Sections())));
  ASSERT_TRUE(lp.measured_mm) << lp.reason;
  // 60 of 180 degrees, and what lies in the patches at their ends.
  const bool is_third =
      lp.reason.find("33 % of") != std::string::npos || lp.reason.find("36 % of") != std::string::npos;
  EXPECT_TRUE(is_third) << lp.reason;
  const auto none =
      Measure(Oval(0, 10, 165), Diameter(fmt::format("definition = \"LP max\"\n{}", Sections())));
  EXPECT_FALSE(none.measured_mm);
  EXPECT_NE(none.reason.find("opposite points"), std::string::npos) << none.reason;
}

TEST_F(DefinitionsTest, AShortArcIsRefusedOrItsAxisIsHeld) {
  const PointCloud arc = Oval(0, 30, 150);
  const auto refused = Measure(arc, Diameter(""));
  EXPECT_FALSE(refused.measured_mm);
  EXPECT_NE(refused.reason.find("radius constrained"), std::string::npos) << refused.reason;
  DimensionOptions hold;
  hold.short_arc = ShortArc::kHoldAxis;
  const auto held = Measure(arc, Diameter(""), hold);
  ASSERT_TRUE(held.measured_mm) << held.reason;
  EXPECT_NEAR(*held.measured_mm, 88.5, 0.003);  // mm: the axis is the true one here
  EXPECT_NE(held.reason.find("radius constrained: the axis is held"), std::string::npos) << held.reason;
  EXPECT_NE(held.reason.find("120 degrees"), std::string::npos) << held.reason;
  // A shift of the view moves the radius by its mean component, and the influence knows.
  ASSERT_EQ(held.influence.views.size(), 1U);
  EXPECT_NEAR(held.influence.views[0].shift.z(), 2 * 3 * std::sqrt(3.0) / (2 * std::numbers::pi), 0.01);
  const auto whole = Measure(Oval(0, 0, 360), Diameter(""), hold);
  EXPECT_EQ(whole.reason, "");
}

// A datum that is held at the nominal axis is no measured one: the length says so.
TEST_F(DefinitionsTest, ADatumHeldAtItsNominalAxisIsRemarked) {
  PointCloud cloud = testing::ScanOf(*model_, {150'000, 0, 0.02, 15}), above;
  DimensionOptions hold;
  hold.short_arc = ShortArc::kHoldAxis;
  EXPECT_EQ(Measure(cloud, kLength, hold).reason, "");
  for (std::size_t i = 0; i < cloud.size(); ++i) {
    const Eigen::Vector3f& p = cloud.points[i];
    if (p.x() > 815 && cloud.normals[i].z() < 0.5F && cloud.normals[i].x() < 0.9F) continue;
    above.points.push_back(p);
    above.normals.push_back(cloud.normals[i]);
  }
  const auto held = Measure(above, kLength, hold);
  ASSERT_TRUE(held.measured_mm) << held.reason;
  EXPECT_NEAR(*held.measured_mm, 1888.4, 0.01);  // mm: the nominal axis is the true one here
  EXPECT_NE(held.reason.find("datum 'right_cylinder' is held at its nominal axis"), std::string::npos)
      << held.reason;
  EXPECT_EQ(held.reason.find("left_cylinder"), std::string::npos) << held.reason;
}

// The right end is a dome, 2.5 mm lower at its rim than in the middle.
TEST_F(DefinitionsTest, AnEndThatIsNotPlaneCountsWithItsQuantile) {
  PointCloud cloud = testing::ScanOf(*model_, {150'000, 0, 0.02, 15});
  for (std::size_t i = 0; i < cloud.size(); ++i) {
    Eigen::Vector3f& p = cloud.points[i];
    if (cloud.normals[i].x() < 0.9F || p.x() < 900) continue;
    p.x() -= 2.5F * (p.y() * p.y() + p.z() * p.z()) / (44.25F * 44.25F);
  }
  const auto length = Measure(cloud, kLength);
  ASSERT_TRUE(length.measured_mm) << length.reason;
  // The highest half per cent of a dome's area begins 0.005 * 2.5 mm below its top; noise 0.02 mm on that.
  EXPECT_NEAR(*length.measured_mm, 1888.4, 0.06);
  EXPECT_NE(length.reason.find("99.5 % quantile"), std::string::npos) << length.reason;
  EXPECT_NE(length.definition.find("quantiles"), std::string::npos) << length.definition;
}

TEST_F(DefinitionsTest, TheFileSaysWhichDefinition) {
  const auto parse = [](const std::string& more) {
    return ParseFeatures(fmt::format("{}{}", kHead, more), "features.toml");
  };
  EXPECT_TRUE(parse(Diameter("definition = \"GG\"\n")).ok());
  EXPECT_EQ(
      parse(Diameter("definition = \"LP min\"\nsections_mm = [1, 2.5]\n"))->dimensions[0].sections_mm.size(),
      2U);
  for (const char* wrong :
       {"definition = \"LQ\"\n", "definition = \"LP max\"\n", "sections_mm = [1.0]\n",
        "definition = \"LP max\"\nsections_mm = []\n", "definition = \"LP max\"\nsections_mm = [1.0, nan]\n",
        "definition = \"LP max\"\nsections_mm = [\"a\"]\n", "definition = \"LP max\"\nsections_mm = 3.0\n"}) {
    const auto features = parse(Diameter(wrong));
    ASSERT_FALSE(features.ok()) << wrong;
    EXPECT_NE(features.error().message.find("right diameter"), std::string::npos) << features.error().message;
  }
  EXPECT_FALSE(parse(fmt::format("{}definition = \"LP max\"\nsections_mm = [1.0]\n", kLength)).ok());
}

}  // namespace
}  // namespace forgescan
