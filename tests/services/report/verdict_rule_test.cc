// The decision rule at and beside its boundaries, the part's verdict, and the uncertainty that goes into
// both.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "services/report/judge_dimensions.h"

namespace forgescan {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

// Limits 10 to 12 mm, U = 0.25 mm: all of them exact in binary, so the boundaries are too.
Verdict Judge(double measured_mm) { return JudgeSize(measured_mm, 0.25, 10.0, 12.0); }
double Below(double value) { return std::nextafter(value, -1e9); }
double Above(double value) { return std::nextafter(value, 1e9); }

TEST(JudgeSize, Boundaries) {
  EXPECT_EQ(Judge(11.0), Verdict::kOk);
  EXPECT_EQ(Judge(10.25), Verdict::kOk);
  EXPECT_EQ(Judge(Below(10.25)), Verdict::kNotDecidable);
  EXPECT_EQ(Judge(10.0), Verdict::kNotDecidable);
  EXPECT_EQ(Judge(9.75), Verdict::kNotDecidable);
  EXPECT_EQ(Judge(Below(9.75)), Verdict::kNotOk);
  EXPECT_EQ(Judge(11.75), Verdict::kOk);
  EXPECT_EQ(Judge(Above(11.75)), Verdict::kNotDecidable);
  EXPECT_EQ(Judge(12.25), Verdict::kNotDecidable);
  EXPECT_EQ(Judge(Above(12.25)), Verdict::kNotOk);
}

TEST(JudgeSize, AToleranceNarrowerThanTwiceUIsNeverOk) {
  for (double size_mm = 9.0; size_mm < 11.5; size_mm += 0.01) {
    EXPECT_NE(JudgeSize(size_mm, 0.3, 10.0, 10.5), Verdict::kOk);
  }
}

TEST(JudgeSize, WhatIsNotANumberIsNotInspected) {
  EXPECT_EQ(JudgeSize(kNan, 0.1, 1.0, 2.0), Verdict::kNotInspected);
  EXPECT_EQ(JudgeSize(1.5, kNan, 1.0, 2.0), Verdict::kNotInspected);
  EXPECT_EQ(JudgeSize(1.5, -0.1, 1.0, 2.0), Verdict::kNotInspected);
  EXPECT_EQ(JudgeSize(1.5, 0.1, kNan, 2.0), Verdict::kNotInspected);
  EXPECT_EQ(JudgeSize(1.5, 0.1, 2.0, 1.0), Verdict::kNotInspected);
}

// A size that came out well inside its limits, but from points of which many were thrown away.
TEST(JudgeDimensions, AReservationIsToldAndDecidesNothing) {
  MeasuredDimension dimension;
  dimension.name = "width";
  dimension.nominal_mm = 11;
  dimension.lower_mm = 10;
  dimension.upper_mm = 12;
  dimension.measured_mm = 11.0;
  EXPECT_EQ(JudgeDimensions(std::vector{dimension}, {}, 0)[0].verdict, Verdict::kOk);
  dimension.reason = "8.0 % of the points were rejected as outliers";
  for (const double size_mm : {11.0, 20.0}) {
    dimension.measured_mm = size_mm;
    const JudgedDimension judged = JudgeDimensions(std::vector{dimension}, {}, 0)[0];
    EXPECT_EQ(judged.verdict, Verdict::kNotDecidable);
    EXPECT_EQ(judged.reason, dimension.reason);
    EXPECT_EQ(judged.measured_mm, size_mm);
  }
}

JudgedDimension Named(const std::string& name, Verdict verdict) {
  JudgedDimension dimension;
  dimension.name = name;
  dimension.verdict = verdict;
  return dimension;
}

TEST(JudgePart, TheWorstCertainThingGoesFirst) {
  std::vector<JudgedDimension> dimensions = {Named("a", Verdict::kOk), Named("b", Verdict::kOk)};
  EXPECT_EQ(JudgePart(dimensions).verdict, Verdict::kOk);
  EXPECT_EQ(JudgePart(dimensions).reason, "");
  dimensions.push_back(Named("c", Verdict::kNotDecidable));
  EXPECT_EQ(JudgePart(dimensions).verdict, Verdict::kNotDecidable);
  dimensions.push_back(Named("d", Verdict::kNotInspected));
  EXPECT_EQ(JudgePart(dimensions).verdict, Verdict::kNotInspected);
  dimensions.push_back(Named("e", Verdict::kNotOk));
  dimensions.push_back(Named("f", Verdict::kNotOk));
  EXPECT_EQ(JudgePart(dimensions).verdict, Verdict::kNotOk);
  EXPECT_EQ(JudgePart(dimensions).reason, "Outside its limits by more than the uncertainty: e, f.");
}

TEST(JudgePart, NothingShownIsNothingInspected) {
  EXPECT_EQ(JudgePart({}).verdict, Verdict::kNotInspected);
  const std::vector<JudgedDimension> unknown = {Named("a", Verdict::kUnknown)};
  EXPECT_EQ(JudgePart(unknown).verdict, Verdict::kNotInspected);
}

TEST(Uncertainty, IsTheRootOfTheSquares) {
  const std::vector<UncertaintyTerm> terms{{"a", 0.03}, {"b", 0.04}, {"c", 0.12}};
  EXPECT_NEAR(ExpandedUncertaintyMm(terms), 2.0 * 0.13, 1e-12) << "mm, 3-4-5 and 5-12-13; rounding only";
  EXPECT_TRUE(std::isnan(ExpandedUncertaintyMm(std::vector<UncertaintyTerm>{{"a", kNan}, {"b", 0.1}})));
}

double TermMm(const std::vector<UncertaintyTerm>& terms, std::string_view name) {
  for (const UncertaintyTerm& term : terms) {
    if (term.name == name) return term.standard_mm;
  }
  ADD_FAILURE() << "no term " << name;
  return kNan;
}

// A width of 100 mm between two views that look at it from both sides, 30 mm off the middle of what they see.
TEST(Uncertainty, FollowsTheInfluenceOfTheViews) {
  Influence influence;
  for (const double side : {-1.0, 1.0}) {
    ViewInfluence view;
    view.shift = {side, 0, 0};
    view.turn_mm = {0, 0, 30};
    view.scale_mm = 10;
    view.stretch_mm = 50;
    influence.views.push_back(view);
  }
  influence.noise_mm = 0.001;
  influence.form_mm = 0.002;
  influence.patch = 0.5;
  influence.outward = 2;
  const UncertaintyBudget budget{.view_shift_mm = 0.03,
                                 .view_turn_rad = 0.001,
                                 .robot_shift_mm = 0.004,
                                 .robot_turn_rad = 0.0,
                                 .refraction_mm = 0.02,
                                 .patch_mm = 0.01,
                                 .surface_mm = 0.006,
                                 .scanner_scale = 0.001,
                                 .temperature_k = 5.0,
                                 .view_temperature_k = 1.0,
                                 .expansion_slope_per_k = 2e-5};
  const auto terms = UncertaintyTerms(budget, influence, 100.0, 0.5);
  const double kRounding = 1e-12;
  EXPECT_EQ(TermMm(terms, "scatter of the points"), 0.001);
  EXPECT_EQ(TermMm(terms, "form of the faces"), 0.002);
  EXPECT_NEAR(TermMm(terms, "patches of a view"), 0.005, kRounding);
  EXPECT_EQ(TermMm(terms, "extreme of many readings"), 0);
  EXPECT_NEAR(TermMm(terms, "view matrices"), std::sqrt(2.0) * std::hypot(0.03, 0.03), kRounding);
  EXPECT_NEAR(TermMm(terms, "robot"), std::sqrt(2.0) * 0.004, kRounding);
  EXPECT_NEAR(TermMm(terms, "refraction"), std::sqrt(2.0) * 0.02, kRounding);
  EXPECT_NEAR(TermMm(terms, "height of the surface"), 0.012, kRounding);
  EXPECT_NEAR(TermMm(terms, "scale of the scanner"), 0.02, kRounding);
  EXPECT_NEAR(TermMm(terms, "temperature of the part"), 0.01, kRounding);
  EXPECT_NEAR(TermMm(terms, "temperature between views"), 50 * 2e-5 * std::sqrt(2.0), kRounding);
}

// The largest of readings lies up to 4 of the 0.003 mm of their points and 2 of the 0.008 mm of their patches
// too far out.
TEST(Uncertainty, CountsThatASizeWasChosenAsAnExtreme) {
  Influence influence;
  influence.views.resize(1);
  influence.noise_mm = 0.003;
  influence.patch = 0.8;
  influence.extreme = {.scatter = 4, .patch = 2};
  const auto terms = UncertaintyTerms({.patch_mm = 0.01}, influence, 100.0, 0.5);
  EXPECT_NEAR(TermMm(terms, "extreme of many readings"), 0.020 / std::sqrt(3.0), 1e-12);  // mm, rounding
}

TEST(Uncertainty, DefaultsOfTheAxleWithoutKnowledgeOfItsViews) {
  const UncertaintyBudget budget;
  ASSERT_TRUE(budget.Check().ok());
  const auto of = [&](double size_mm, double fit_mm) {
    return ExpandedUncertaintyMm(UncertaintyTerms(budget, {}, size_mm, fit_mm));
  };
  EXPECT_NEAR(of(1888.0, 0.005), 0.2, 0.05) << "mm, the budget of a hot length of 1888 mm";
  EXPECT_NEAR(of(89.0, 0.01), 0.09, 0.02) << "mm, the budget of a diameter of 89 mm";
  EXPECT_TRUE(std::isnan(of(89.0, kNan)));
  EXPECT_FALSE(UncertaintyBudget{.scanner_scale = kNan}.Check().ok());
  EXPECT_FALSE(UncertaintyBudget{.temperature_k = -1.0}.Check().ok());
}

MeasuredDimension Measured(double measured_mm) {
  MeasuredDimension dimension;
  dimension.name = "width";
  dimension.nominal_mm = 100.0;
  dimension.lower_mm = 99.0;
  dimension.upper_mm = 101.0;
  dimension.reference_degc = 900.0;
  dimension.measured_mm = measured_mm;
  dimension.points = 1000;
  return dimension;
}

TEST(JudgeDimensions, MeasuresJudgesAndKeepsTheReason) {
  MeasuredDimension missing = Measured(0.0);
  missing.measured_mm.reset();
  missing.reason = "Too few points.";
  MeasuredDimension stated = Measured(100.5);
  stated.expanded_uncertainty_mm = 0.6;
  const std::vector<MeasuredDimension> measured = {Measured(100.25), missing, stated};
  const auto judged = JudgeDimensions(measured, UncertaintyBudget{}, 900.0);
  EXPECT_EQ(judged[0].verdict, Verdict::kOk);
  EXPECT_EQ(judged[0].deviation_mm, 0.25);
  EXPECT_EQ(judged[1].verdict, Verdict::kNotInspected);
  EXPECT_EQ(judged[1].reason, "Too few points.");
  EXPECT_TRUE(std::isnan(judged[1].measured_mm) && std::isnan(judged[1].deviation_mm));
  EXPECT_EQ(judged[2].uncertainty_mm, 0.6);
  EXPECT_EQ(judged[2].verdict, Verdict::kNotDecidable);
}

TEST(JudgeDimensions, LimitsOfAnotherTemperatureAreNotApplied) {
  const std::vector<MeasuredDimension> measured = {Measured(100.0)};
  EXPECT_EQ(JudgeDimensions(measured, {}, 905.0)[0].verdict, Verdict::kNotInspected);
  EXPECT_EQ(JudgeDimensions(measured, {}, kNan)[0].verdict, Verdict::kNotInspected);
  EXPECT_NE(JudgeDimensions(measured, {}, 905.0)[0].reason.find("905.0"), std::string::npos);
}

}  // namespace
}  // namespace forgescan
