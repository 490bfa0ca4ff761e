// Sizes and deviations of a synthetic scan against the design model it was taken from.
#include "services/report/model_evaluator.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "services/report/judge_dimensions.h"
#include "tests/common/shapes/test_axle.h"

namespace forgescan {
namespace {

constexpr const char* kFeatures = R"(
part = "axle"
reference_temperature_degc = 900.0
[[dimension]]
name = "left plate width"
type = "width"
faces = ["left_plate_front", "left_plate_back"]
lower_mm = 178.0
upper_mm = 180.0
[[dimension]]
name = "right cylinder diameter"
type = "diameter"
faces = ["right_cylinder"]
lower_mm = 88.0
upper_mm = 89.0
)";

std::unique_ptr<ModelEvaluator> Evaluator() {
  auto model = testing::MakeAxle({}, 4.0);
  EXPECT_TRUE(model.ok()) << model.error().message;
  auto features = ParseFeatures(kFeatures, "features.toml");
  EXPECT_TRUE(features.ok()) << features.error().message;
  auto evaluator = ModelEvaluator::Make(*model, *features, {});
  EXPECT_TRUE(evaluator.ok()) << evaluator.error().message;
  return std::move(*evaluator);
}

PointCloud Scan() {
  const auto model = testing::MakeAxle({}, 4.0);
  return testing::ScanOf(*model, {.points = 40'000, .foreign_share = 0.0, .noise_mm = 0.03});
}

TEST(ModelEvaluator, MeasuresWhatTheModelSays) {
  const auto evaluator = Evaluator();
  const auto measured = evaluator->Evaluate(Scan());
  ASSERT_TRUE(measured.ok()) << measured.error().message;
  const auto judged = JudgeDimensions(*measured, UncertaintyBudget{}, 900.0);
  ASSERT_EQ(judged.size(), 2u);
  EXPECT_NEAR(judged[0].measured_mm, 178.9, 0.02)
      << "mm; 0.03 mm noise over hundreds of points, chord error of the model";
  EXPECT_NEAR(judged[1].measured_mm, 88.5, 0.03) << "mm; the same, and the facets of the cylinder";
  EXPECT_EQ(JudgePart(judged).verdict, Verdict::kOk) << JudgePart(judged).reason;
}

TEST(ModelEvaluator, DeviationsAreTheNoiseAndSigned) {
  const auto evaluator = Evaluator();
  PointCloud cloud = Scan();
  for (std::size_t i = 0; i < cloud.size(); ++i) {
    cloud.points[i] += 0.5F * cloud.normals[i];
  }
  auto deviations = evaluator->DeviationsMm(cloud);
  ASSERT_TRUE(deviations.ok());
  ASSERT_EQ(deviations->size(), cloud.size());
  std::nth_element(deviations->begin(), deviations->begin() + 20'000, deviations->end());
  EXPECT_NEAR((*deviations)[20'000], 0.5, 0.01) << "mm, the median; 0.03 mm noise over 40 000 points";
}

TEST(ModelEvaluator, AnEmptyCloudMeasuresNothing) {
  const auto evaluator = Evaluator();
  const auto measured = evaluator->Evaluate(PointCloud{});
  if (measured.ok()) {
    for (const MeasuredDimension& dimension : *measured) {
      EXPECT_FALSE(dimension.measured_mm.has_value());
      EXPECT_NE(dimension.reason, "");
    }
  }
  EXPECT_EQ(evaluator->Dimensions().size(), 2u);
  EXPECT_NEAR(evaluator->Dimensions()[0].nominal_mm, 178.9, 1e-6) << "mm; single precision of the model";
}

}  // namespace
}  // namespace forgescan
