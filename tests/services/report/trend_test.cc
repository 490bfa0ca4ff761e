// Student's t against printed tables, the line against a calculation by hand, significance and the way to the
// limit.
#include "services/report/trend.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>

#include "services/report/student_t.h"

namespace forgescan {
namespace {

TEST(StudentQuantile, AgreesWithPrintedTables) {
  constexpr double kPrinted = 5e-4;  // tables are rounded to three decimals
  EXPECT_NEAR(StudentQuantile(0.95, 1), 12.706, kPrinted);
  EXPECT_NEAR(StudentQuantile(0.95, 2), 4.303, kPrinted);
  EXPECT_NEAR(StudentQuantile(0.95, 3), 3.182, kPrinted);
  EXPECT_NEAR(StudentQuantile(0.95, 6), 2.447, kPrinted);
  EXPECT_NEAR(StudentQuantile(0.95, 7), 2.365, kPrinted);
  EXPECT_NEAR(StudentQuantile(0.95, 23), 2.069, kPrinted);
  EXPECT_NEAR(StudentQuantile(0.99, 10), 3.169, kPrinted);
  EXPECT_NEAR(StudentQuantile(0.95, 100), 1.984, kPrinted);
  EXPECT_TRUE(std::isnan(StudentQuantile(0.95, 0)));
  EXPECT_TRUE(std::isnan(StudentQuantile(1.0, 5)));
}

// y = 1 2 2 3 at x = 0 1 2 3: mean 1.5 and 2, Sxx = 5, Sxy = 3, b = 0.6, a = 1.1, residuals -0.1 0.3 -0.3
// 0.1, SSE = 0.2, s = sqrt(0.1); moving ranges 1 0 1.
TEST(Trend, AgreesWithTheCalculationByHand) {
  constexpr double kRounding = 1e-12;
  const std::vector<TrendPoint> points = {{0, 1}, {1, 2}, {2, 2}, {3, 3}};
  const Result<Trend> trend = FitTrend(points);
  ASSERT_TRUE(trend.ok());
  EXPECT_NEAR(trend->slope_mm, 0.6, kRounding);
  EXPECT_NEAR(trend->intercept_mm, 1.1, kRounding);
  EXPECT_NEAR(trend->sxx, 5.0, kRounding);
  EXPECT_NEAR(trend->residual_sigma_mm, std::sqrt(0.1), kRounding);
  EXPECT_NEAR(trend->individual_sigma_mm, 2.0 / 3.0 / 1.128, kRounding);
  EXPECT_NEAR(trend->PredictionHalfWidthMm(4.0), 4.30265 * std::sqrt(0.1 * (1.0 + 0.25 + 6.25 / 5.0)), 1e-4)
      << "mm; t with five decimals";
  EXPECT_FALSE(trend->significant) << "fewer than 8 points";
}

std::vector<TrendPoint> Ramp(int count, double slope_mm, double sigma_mm, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  std::normal_distribution<double> noise_mm(0.0, sigma_mm);
  std::vector<TrendPoint> points;
  for (int i = 0; i < count; ++i) {
    points.push_back(
        {static_cast<double>(i), 100.0 + slope_mm * i + (sigma_mm > 0 ? noise_mm(random) : 0.0)});
  }
  return points;
}

int FoundOf(int runs, int count, double slope_mm) {
  int found = 0;
  for (int run = 0; run < runs; ++run) {
    const auto trend = FitTrend(Ramp(count, slope_mm, 0.05, static_cast<std::uint64_t>(run) + 1));
    found += trend.ok() && trend->significant ? 1 : 0;
  }
  return found;
}

TEST(Trend, FindsWearAsOftenAsTheTheorySays) {
  // 0.02 mm a part on 0.05 mm of noise: 76 % at 9 parts, 99 % at 12; without wear 5 %. 1000 runs: three sigma
  // are below 4.1 %.
  EXPECT_NEAR(FoundOf(1000, 9, 0.02), 760, 41);
  EXPECT_NEAR(FoundOf(1000, 12, 0.02), 985, 15);
  EXPECT_NEAR(FoundOf(1000, 12, 0.0), 50, 21);
}

TEST(Trend, SevenPartsAreTooFewEvenOnAPerfectLine) {
  EXPECT_FALSE(FitTrend(Ramp(7, 0.1, 0.0, 1))->significant);
  EXPECT_TRUE(FitTrend(Ramp(8, 0.1, 0.0, 1))->significant);
  EXPECT_FALSE(FitTrend(Ramp(8, 0.0, 0.0, 1))->significant);
}

TEST(PartsToLimit, OnAPerfectLine) {
  const auto trend = FitTrend(Ramp(10, 0.125, 0.0, 1));
  ASSERT_TRUE(trend.ok());
  const auto left = PartsToLimit(*trend, {99.0, 101.8, 0.25}, 9.0);  // (101.55 - 101.125) / 0.125 = 3.4
  ASSERT_TRUE(left.has_value());
  EXPECT_EQ(*left, 3);
  EXPECT_EQ(PartsToLimit(*FitTrend(Ramp(10, -0.125, 0.0, 1)), {98.2, 101.0, 0.25}, 9.0),
            std::optional<int>(3));
  EXPECT_EQ(PartsToLimit(*trend, {99.0, 101.0, 0.25}, 9.0), std::optional<int>(0)) << "passed already";
}

TEST(PartsToLimit, NothingWithoutATrendOrFarAway) {
  EXPECT_FALSE(PartsToLimit(*FitTrend(Ramp(10, 0.0, 0.0, 1)), {99.0, 101.0, 0.1}, 9.0).has_value());
  EXPECT_FALSE(PartsToLimit(*FitTrend(Ramp(10, 1e-6, 0.0, 1)), {99.0, 101.0, 0.1}, 9.0).has_value());
}

TEST(Trend, WhatDeterminesNoLineIsAnError) {
  EXPECT_EQ(FitTrend({}).error().code, ErrorCode::kDegenerate);
  EXPECT_EQ(FitTrend(Ramp(2, 0.1, 0.0, 1)).error().code, ErrorCode::kDegenerate);
  const std::vector<TrendPoint> same = {{1, 1}, {1, 2}, {1, 3}};
  EXPECT_EQ(FitTrend(same).error().code, ErrorCode::kDegenerate);
  const std::vector<TrendPoint> nan = {{1, 1}, {2, std::numeric_limits<double>::quiet_NaN()}, {3, 3}};
  EXPECT_EQ(FitTrend(nan).error().code, ErrorCode::kInvalidArgument);
}

}  // namespace
}  // namespace forgescan
