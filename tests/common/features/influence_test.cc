// What the influence of a size says of moved views, against the size of the moved points.
#include <gtest/gtest.h>

#include <cmath>
#include <functional>

#include "services/common/features/dimensions.h"
#include "tests/common/shapes/test_axle.h"

namespace forgescan {
namespace {

const std::vector<std::string> kDimensions = {"total length", "left plate width", "right diameter"};

using Move = std::function<Eigen::Vector3d(const Eigen::Vector3d&)>;

class InfluenceTest : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    auto model = testing::MakeAxle({}, 4);
    ASSERT_TRUE(model.ok());
    const auto features = ParseFeatures(testing::AxleFeatures(kDimensions), "features.toml");
    ASSERT_TRUE(features.ok());
    auto bound = BindFeatures(*features, *model);
    ASSERT_TRUE(bound.ok());
    cloud_ = new PointCloud(testing::ScanOf(*model, {80'000, 0, 0.02, 21}));
    // Four views: front and rear of the left and the right half. The lower quarter of all is not seen.
    PointCloud seen;
    for (std::size_t i = 0; i < cloud_->size(); ++i) {
      const Eigen::Vector3f& p = cloud_->points[i];
      if (p.z() < -20) continue;
      seen.points.push_back(p);
      seen.normals.push_back(cloud_->normals[i]);
      seen.view.push_back(static_cast<std::uint16_t>((p.x() > 0 ? 2 : 0) + (p.y() > 0 ? 1 : 0)));
    }
    *cloud_ = seen;
    auto evaluator = DimensionEvaluator::Build(std::move(*model), *bound, {});
    ASSERT_TRUE(evaluator.ok());
    evaluator_ = new DimensionEvaluator(std::move(*evaluator));
  }
  static void TearDownTestSuite() {
    delete evaluator_;
    delete cloud_;
  }

  static std::vector<DimensionResult> Evaluate(std::uint16_t view, const Move& move) {
    PointCloud moved = *cloud_;
    for (std::size_t i = 0; i < moved.size(); ++i) {
      if (moved.view[i] == view) moved.points[i] = move(moved.points[i].cast<double>()).cast<float>();
    }
    const auto results = evaluator_->Evaluate(moved);
    EXPECT_TRUE(results.ok());
    return *results;
  }

  static PointCloud* cloud_;
  static DimensionEvaluator* evaluator_;
};
PointCloud* InfluenceTest::cloud_ = nullptr;
DimensionEvaluator* InfluenceTest::evaluator_ = nullptr;

// 0.03 mm: larger than what single precision leaves, small enough to stay linear.
constexpr double kStepMm = 0.03;
// Of a step: curvature of the fit, and points that the move takes across the limit of rejection.
constexpr double kLinear = 0.03;

TEST_F(InfluenceTest, ShiftsTurnsAndStretchesMoveTheSizesAsSaid) {
  const auto middles = ViewMiddles(cloud_->points, cloud_->view);
  const auto before = evaluator_->Evaluate(*cloud_);
  ASSERT_TRUE(before.ok());
  for (std::uint16_t view = 0; view < 4; ++view) {
    const Eigen::Vector3d middle = middles[view];
    const double turn = kStepMm / 100, stretch = kStepMm / 200;
    for (int axis = 0; axis < 3; ++axis) {
      const Eigen::Vector3d unit = Eigen::Vector3d::Unit(axis);
      const auto shifted = Evaluate(view, [&](const auto& p) { return Eigen::Vector3d(p + kStepMm * unit); });
      const auto turned =
          Evaluate(view, [&](const auto& p) { return Eigen::Vector3d(p + turn * unit.cross(p - middle)); });
      for (std::size_t i = 0; i < before->size(); ++i) {
        ASSERT_TRUE((*before)[i].measured_mm && shifted[i].measured_mm && turned[i].measured_mm);
        for (const ViewInfluence& said : (*before)[i].influence.views) {
          if (said.view != view) continue;
          EXPECT_NEAR(*shifted[i].measured_mm - *(*before)[i].measured_mm, kStepMm * said.shift[axis],
                      kLinear * kStepMm)
              << said.view << ", shift " << axis << ": " << shifted[i].name;
          EXPECT_NEAR(*turned[i].measured_mm - *(*before)[i].measured_mm, turn * said.turn_mm[axis],
                      kLinear * kStepMm)
              << said.view << ", turn " << axis << ": " << turned[i].name;
        }
      }
    }
    const auto scaled =
        Evaluate(view, [&](const auto& p) { return Eigen::Vector3d(p + stretch * (p - middle)); });
    for (std::size_t i = 0; i < before->size(); ++i) {
      for (const ViewInfluence& said : (*before)[i].influence.views) {
        if (said.view != view) continue;
        EXPECT_NEAR(*scaled[i].measured_mm - *(*before)[i].measured_mm, stretch * said.scale_mm,
                    kLinear * kStepMm)
            << said.view << ": " << scaled[i].name;
      }
    }
  }
}

// All views moved alike move no size; stretched alike, every size grows by its share.
TEST_F(InfluenceTest, CommonMovesCancelAndACommonStretchIsTheSize) {
  const auto results = evaluator_->Evaluate(*cloud_);
  ASSERT_TRUE(results.ok());
  for (const DimensionResult& result : *results) {
    Eigen::Vector3d shift = Eigen::Vector3d::Zero();
    double stretch_mm = 0;
    for (const ViewInfluence& view : result.influence.views) {
      shift += view.shift;
      stretch_mm += view.stretch_mm;
    }
    EXPECT_NEAR(result.influence.outward, 2, 0.01) << result.name;  // out on both sides
    EXPECT_LT(shift.norm(), 0.01) << result.name;  // the planes' normals differ by some 1e-3 rad
    EXPECT_NEAR(stretch_mm, *result.measured_mm, 0.005 * *result.measured_mm) << result.name;
  }
}

// A face with waves 0.2 mm high, three quarters of it seen, is less sure than a smooth one.
TEST_F(InfluenceTest, TheFormOfAFaceIsNotTakenForNoise) {
  PointCloud wavy = *cloud_;
  for (std::size_t i = 0; i < wavy.size(); ++i) {
    const Eigen::Vector3f p = wavy.points[i];
    wavy.points[i] += 0.2F * std::sin(p.x() / 12) * std::cos(std::atan2(p.z(), p.y()) * 5) * wavy.normals[i];
  }
  const auto smooth = evaluator_->Evaluate(*cloud_), rough = evaluator_->Evaluate(wavy);
  ASSERT_TRUE(smooth.ok() && rough.ok());
  const DimensionResult &one = (*smooth)[2], &other = (*rough)[2];
  ASSERT_TRUE(one.measured_mm && other.measured_mm) << other.reason;
  EXPECT_LT(one.influence.form_mm, 0.002);
  EXPECT_GT(other.influence.form_mm, 0.005);
  EXPECT_GT(other.form_range_mm, 0.3);
  EXPECT_GT(other.form_d95_mm, one.form_d95_mm + 0.1);
  // As if the points were independent, it would be sure to some um.
  EXPECT_GT(other.influence.form_mm, 2 * other.standard_uncertainty_mm);
}

// Fewer and fewer points: the influence of scatter and form never vanishes, however empty the cells are.
TEST_F(InfluenceTest, FewPointsAreNotSurerThanMany) {
  const auto many = evaluator_->Evaluate(*cloud_);
  ASSERT_TRUE(many.ok());
  for (const std::size_t step : {20, 40, 80}) {
    PointCloud few;
    for (std::size_t i = 0; i < cloud_->size(); i += step) {
      few.points.push_back(cloud_->points[i]);
      few.normals.push_back(cloud_->normals[i]);
      few.view.push_back(cloud_->view[i]);
    }
    const auto results = evaluator_->Evaluate(few);
    ASSERT_TRUE(results.ok());
    for (std::size_t i = 0; i < results->size(); ++i) {
      const DimensionResult& result = (*results)[i];
      if (!result.measured_mm) continue;
      EXPECT_GT(result.influence.noise_mm, 2 * (*many)[i].influence.noise_mm) << result.name << " " << step;
      EXPECT_GT(result.influence.noise_mm, 0.8 * result.standard_uncertainty_mm)
          << result.name << " " << step;
    }
  }
}

}  // namespace
}  // namespace forgescan
