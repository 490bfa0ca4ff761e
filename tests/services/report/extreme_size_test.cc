// The largest and the smallest of many local sizes: errors alone push them outwards, and U must know.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <numbers>
#include <random>

#include "services/common/features/dimensions.h"
#include "services/report/uncertainty.h"
#include "tests/common/shapes/test_axle.h"

namespace forgescan::testing {
namespace {

constexpr double kDiameterMm = 88.5;
constexpr double kNoiseMm = 0.03;

// The right cylinder, seen all around with noise; its radius grows by oval_mm across y and shrinks across z.
PointCloud Cylinder(int points, double oval_mm, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> along(815, 944), turn(0, 2 * std::numbers::pi);
  std::normal_distribution<double> noise(0, kNoiseMm);
  PointCloud cloud;
  for (int i = 0; i < points; ++i) {
    const double angle = turn(random);
    const double radius = kDiameterMm / 2 + oval_mm * std::cos(2 * angle) + noise(random);
    const Eigen::Vector3d out(0, std::cos(angle), std::sin(angle));
    cloud.points.push_back((along(random) * Eigen::Vector3d::UnitX() + radius * out).cast<float>());
    cloud.normals.push_back(out.cast<float>());
  }
  return cloud;
}

// An evaluator of the right diameter by that definition, in three sections.
Result<DimensionEvaluator> EvaluatorOf(const std::string& definition) {
  ASSIGN_OR_RETURN(ModelBundle model, MakeAxle({}, 4));
  ASSIGN_OR_RETURN(const auto face, FindFace(model, "right_cylinder"));
  const double sign = model.faces[face].direction.x() < 0 ? 1 : -1, end = model.faces[face].point.x();
  const std::string text = fmt::format("{}definition = \"{}\"\nsections_mm = [{:.3f}, {:.3f}, {:.3f}]\n",
                                       AxleFeatures({"right diameter"}), definition, sign * (end - 840),
                                       sign * (end - 880), sign * (end - 920));
  ASSIGN_OR_RETURN(const Features features, ParseFeatures(text, "features.toml"));
  ASSIGN_OR_RETURN(Features bound, BindFeatures(features, model));
  return DimensionEvaluator::Build(std::move(model), std::move(bound), {});
}

struct Parts {
  int points = 40'000;  // of each: 14 in a patch
  int count = 40;
};

struct Held {
  int held = 0;
  double mean_error_mm = 0, mean_expanded_mm = 0;
};

// Of parts measured with no errors but the points' own, how often U holds the true size.
Held Count(const std::string& definition, double oval_mm, double true_mm, const Parts& parts) {
  Held sum;
  const auto evaluator = EvaluatorOf(definition);
  EXPECT_TRUE(evaluator.ok());
  UncertaintyBudget exact{0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0};
  for (int part = 1; part <= parts.count && evaluator.ok(); ++part) {
    const auto results =
        evaluator->Evaluate(Cylinder(parts.points, oval_mm, static_cast<std::uint64_t>(part)));
    EXPECT_TRUE(results.ok() && results->front().measured_mm);
    if (!results.ok() || !results->front().measured_mm) return sum;
    const DimensionResult& size = results->front();
    const double error_mm = *size.measured_mm - true_mm;
    const double expanded_mm = ExpandedUncertaintyMm(
        UncertaintyTerms(exact, size.influence, *size.measured_mm, size.standard_uncertainty_mm));
    sum.held += std::abs(error_mm) <= expanded_mm ? 1 : 0;
    sum.mean_error_mm += error_mm / parts.count;
    sum.mean_expanded_mm += expanded_mm / parts.count;
  }
  std::printf("%s, %d points, oval by %.2f mm: %d of %d held, mean error %.4f mm, mean U %.4f mm\n",
              definition.c_str(), parts.points, oval_mm, sum.held, parts.count, sum.mean_error_mm,
              sum.mean_expanded_mm);
  return sum;
}

// Of 40 intervals that hold the truth with 95 % each, fewer than 35 do in one run of 500 (binomial).
constexpr int kLeastHeld = 35;

// A perfect cylinder: the largest of 135 sizes is the largest of 135 errors.
TEST(ExtremeSizeTest, HoldsTheTruthOfAPerfectCylinder) {
  const Held largest = Count("LP max", 0, kDiameterMm, {}), smallest = Count("LP min", 0, kDiameterMm, {});
  EXPECT_GE(largest.held, kLeastHeld);
  EXPECT_GE(smallest.held, kLeastHeld);
  EXPECT_GT(largest.mean_error_mm, kNoiseMm / 2);  // the test has something to find
  EXPECT_LT(smallest.mean_error_mm, -kNoiseMm / 2);
  // No more than what it is about: 2.7 standard deviations of a reading and twice one of them.
  EXPECT_LT(largest.mean_expanded_mm, 3 * largest.mean_error_mm);
}

// From 3 points a patch, the fewest it takes: each says little of its own noise, and the extreme favours the
// patches with the fewest.
TEST(ExtremeSizeTest, HoldsTheTruthWithFewPoints) {
  for (const int points : {9'000, 12'000, 20'000, 40'000}) {
    const Held largest = Count("LP max", 0, kDiameterMm, {.points = points, .count = 200});
    // Of 200 intervals that hold the truth with 95.45 % each, fewer than 181 do in one run of 1000
    // (binomial).
    EXPECT_GE(largest.held, 181) << points;
    EXPECT_LT(largest.mean_expanded_mm, 3 * largest.mean_error_mm) << points;
  }
}

// The form says which size is the largest, and fewer compete.
TEST(ExtremeSizeTest, HoldsTheTruthOfAnOvalCylinder) {
  const Held largest = Count("LP max", 0.2, kDiameterMm + 0.4, {}),
             smallest = Count("LP min", 0.2, kDiameterMm - 0.4, {});
  EXPECT_GE(largest.held, kLeastHeld);
  EXPECT_GE(smallest.held, kLeastHeld);
  // The form does not count as an error of a reading: no more than on the perfect cylinder.
  EXPECT_LT(std::max(largest.mean_expanded_mm, smallest.mean_expanded_mm), 3 * kNoiseMm);
}

}  // namespace
}  // namespace forgescan::testing
