#include "services/fusion/fuse.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <limits>

namespace forgescan {
namespace {

using ::testing::HasSubstr;

// EN 1993-1-2 above 860 degC: eps = 2e-5 T - 6.2e-3.
ExpansionCurve Curve() { return *ExpansionCurve::Create({860, 1200}, {0.011, 0.0178}); }

ViewMatrices TwoViews() {
  ViewMatrices views;
  views.array_from_camera.push_back(Eigen::Isometry3d(Eigen::Translation3d(900, 0, 0)));
  Eigen::Isometry3d turned(Eigen::AngleAxisd(M_PI / 2, Eigen::Vector3d::UnitZ()));
  turned.pretranslate(Eigen::Vector3d(-900, 0, 0));
  views.array_from_camera.push_back(turned);
  return views;
}

ViewCloud OnePoint(int view, double temperature_degc, const Eigen::Vector3f& point) {
  return {view, temperature_degc, {{point}, {Eigen::Vector3f::UnitX()}, {0.02F}, {0}}};
}

TEST(Expansion, AgreesWithTheCurveItWasMadeFrom) {
  const auto scale = Curve().Scale(876.0, 900.0);
  ASSERT_TRUE(scale.ok());
  const double wanted = (1 + 2e-5 * 900 - 6.2e-3) / (1 + 2e-5 * 876 - 6.2e-3);
  EXPECT_NEAR(*scale, wanted, 1e-12);                // both linear: rounding only
  EXPECT_NEAR(1888.0 * (*scale - 1), 0.896, 0.001);  // mm; 24 K over the axle, docs/design.md
}

TEST(Expansion, NothingIsExtrapolated) {
  for (const double t : {859.0, 1201.0, std::numeric_limits<double>::quiet_NaN()}) {
    EXPECT_FALSE(Curve().Scale(t, 900).ok()) << t;
    EXPECT_FALSE(Curve().Scale(900, t).ok()) << t;
  }
}

TEST(Expansion, BadTablesAreRefused) {
  EXPECT_FALSE(ExpansionCurve::Create({900}, {0.01}).ok());
  EXPECT_FALSE(ExpansionCurve::Create({900, 900}, {0.01, 0.02}).ok());
  EXPECT_FALSE(ExpansionCurve::Create({900, 1000}, {0.01, std::numeric_limits<double>::quiet_NaN()}).ok());
  EXPECT_FALSE(ExpansionCurve::Create({900, 1000, 1100}, {0.01, 0.02}).ok());
}

TEST(Fuse, MovesScalesAndOrdersViews) {
  const std::vector<ViewCloud> views{OnePoint(1, 890, {44, 0, 0}), OnePoint(0, 880, {44, 0, 0})};
  const auto fused = FuseViews(views, TwoViews(), Curve(), {});
  ASSERT_TRUE(fused.ok());
  const double s880 = *Curve().Scale(880, 900), s890 = *Curve().Scale(890, 900);
  ASSERT_EQ(fused->cloud_in_array.size(), 2u);
  EXPECT_NEAR(fused->cloud_in_array.points[0].x(), 944 * s880, 1e-4);   // mm, float
  EXPECT_NEAR(fused->cloud_in_array.points[1].x(), -900 * s890, 1e-4);  // mm, float
  EXPECT_NEAR(fused->cloud_in_array.points[1].y(), 44 * s890, 1e-4);    // mm, float
  EXPECT_NEAR(fused->cloud_in_array.normals[1].y(), 1.0, 1e-6);
  EXPECT_EQ(fused->cloud_in_array.view, (std::vector<std::uint16_t>{0, 1}));
  EXPECT_EQ(fused->scales, (std::vector<double>{s890, s880}));
}

TEST(Fuse, ShrinksAboutTheFixedPoint) {
  const std::vector<ViewCloud> views{OnePoint(0, 880, {-800, 0, 0})};
  const auto fused =
      FuseViews(views, TwoViews(), Curve(), {.reference_degc = 900, .fixed_in_array_mm = {100, 0, 0}});
  EXPECT_NEAR(fused->cloud_in_array.points[0].x(), 100.0, 1e-5);  // mm
}

TEST(Fuse, AViewWithoutMatrixOrTemperatureIsAnError) {
  EXPECT_FALSE(FuseViews(std::vector{OnePoint(2, 900, {0, 0, 0})}, TwoViews(), Curve(), {}).ok());
  EXPECT_FALSE(FuseViews(std::vector{OnePoint(0, 300, {0, 0, 0})}, TwoViews(), Curve(), {}).ok());
}

class ViewsFile : public ::testing::Test {
 protected:
  void TearDown() override { std::filesystem::remove(path_); }
  Result<ViewMatrices> Load(const std::string& text) {
    std::ofstream(path_) << text;
    return ViewMatrices::Load(path_);
  }
  std::string path_ = ::testing::TempDir() + "forgescan_views_test.toml";
};

TEST_F(ViewsFile, Reads) {
  const auto views = Load(
      "path_crc32 = 4294967295\nrecorded_body_degc = 35.5\n[[view]]\nindex = 0\n"
      "array_from_camera = [1,0,0,5, 0,1,0,6, 0,0,1,7, 0,0,0,1]\n");
  ASSERT_TRUE(views.ok()) << views.error().message;
  EXPECT_EQ(views->path_crc32, 0xffffffffu);
  EXPECT_EQ(views->array_from_camera.at(0).translation(), Eigen::Vector3d(5, 6, 7));
}

TEST_F(ViewsFile, RefusesWhatIsNotRigid) {
  for (const char* matrix :
       {"[1,0,0,0, 0,1,0,0, 0,0,1.001,0, 0,0,0,1]", "[1,0,0,0, 0,1,0,0, 0,0,-1,0, 0,0,0,1]",
        "[1,0,0,0, 0,1,0,0, 0,0,1,0, 0,0,0,2]", "[1,0,0,0, 0,1,0,0, 0,0,1,0]"}) {
    const auto views = Load(
        std::string("path_crc32 = 1\nrecorded_body_degc = 30\n[[view]]\nindex = 0\narray_from_camera = ") +
        matrix);
    ASSERT_FALSE(views.ok()) << matrix;
    EXPECT_THAT(views.error().message, HasSubstr("view[0].array_from_camera"));
  }
}

TEST_F(ViewsFile, RefusesNoViewsAndWrongOrder) {
  EXPECT_FALSE(Load("path_crc32 = 1\nrecorded_body_degc = 30\n").ok());
  EXPECT_FALSE(Load("path_crc32 = 1\nrecorded_body_degc = 30\n[[view]]\nindex = 1\n"
                    "array_from_camera = [1,0,0,0, 0,1,0,0, 0,0,1,0, 0,0,0,1]\n")
                   .ok());
}

}  // namespace
}  // namespace forgescan
