#include "services/report/trend.h"

#include <cmath>

#include "services/report/student_t.h"

namespace forgescan {
namespace {

constexpr double kConfidence = 0.95;
constexpr double kMovingRangeToSigma = 1.128;  // d2 for n = 2

Status CheckPoints(std::span<const TrendPoint> points) {
  if (points.size() < 3) {
    return Fail(ErrorCode::kDegenerate, "trend: {} points, at least 3 are needed", points.size());
  }
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (!std::isfinite(points[i].part_index) || !std::isfinite(points[i].value_mm)) {
      return Fail(ErrorCode::kInvalidArgument, "trend: point {} is ({}, {}), both must be finite", i,
                  points[i].part_index, points[i].value_mm);
    }
  }
  return {};
}

double MeanMovingRange(std::span<const TrendPoint> points) {
  double sum = 0.0;
  for (std::size_t i = 1; i < points.size(); ++i) {
    sum += std::abs(points[i].value_mm - points[i - 1].value_mm);
  }
  return sum / static_cast<double>(points.size() - 1);
}

double ResidualSigma(const Trend& trend, std::span<const TrendPoint> points) {
  double sse = 0.0;
  for (const TrendPoint& point : points) {
    const double residual_mm = point.value_mm - trend.At(point.part_index);
    sse += residual_mm * residual_mm;
  }
  return std::sqrt(sse / static_cast<double>(points.size() - 2));
}

// Whether the prediction interval of a value so many parts on still lies within the limit ahead.
bool Within(const Trend& trend, const SizeLimits& limits, double part_index) {
  const double half_mm = trend.PredictionHalfWidthMm(part_index);
  return trend.slope_mm > 0.0 ? trend.At(part_index) + half_mm <= limits.upper_mm - limits.uncertainty_mm
                              : trend.At(part_index) - half_mm >= limits.lower_mm + limits.uncertainty_mm;
}

}  // namespace

double Trend::PredictionHalfWidthMm(double part_index) const {
  const double off = part_index - mean_index;
  return t_limit * residual_sigma_mm * std::sqrt(1.0 + 1.0 / count + off * off / sxx);
}

Result<Trend> FitTrend(std::span<const TrendPoint> points) {
  RETURN_IF_ERROR(CheckPoints(points));
  Trend trend;
  trend.count = static_cast<int>(points.size());
  double mean_mm = 0.0;
  for (const TrendPoint& point : points) {
    trend.mean_index += point.part_index / trend.count;
    mean_mm += point.value_mm / trend.count;
  }
  double sxy = 0.0;
  for (const TrendPoint& point : points) {
    const double off = point.part_index - trend.mean_index;
    trend.sxx += off * off;
    sxy += off * (point.value_mm - mean_mm);
  }
  if (trend.sxx <= 0.0) {
    return Fail(ErrorCode::kDegenerate, "trend: all {} points are at part index {}", points.size(),
                trend.mean_index);
  }
  trend.slope_mm = sxy / trend.sxx;
  trend.intercept_mm = mean_mm - trend.slope_mm * trend.mean_index;
  trend.residual_sigma_mm = ResidualSigma(trend, points);
  trend.individual_sigma_mm = MeanMovingRange(points) / kMovingRangeToSigma;
  trend.t_limit = StudentQuantile(kConfidence, trend.count - 2);
  trend.significant = trend.count >= kTrendMinParts && std::abs(trend.slope_mm) * std::sqrt(trend.sxx) >
                                                           trend.t_limit * trend.residual_sigma_mm;
  return trend;
}

std::optional<int> PartsToLimit(const Trend& trend, const SizeLimits& limits, double last_index) {
  if (!trend.significant || Within(trend, limits, last_index + kTrendHorizonParts)) {
    return std::nullopt;
  }
  // Beyond the mean the interval's edge moves towards the limit only: bisection finds the one crossing.
  int inside = 0;
  int outside = kTrendHorizonParts;
  while (outside - inside > 1) {
    const int middle = (inside + outside) / 2;
    (Within(trend, limits, last_index + middle) ? inside : outside) = middle;
  }
  return inside;
}

}  // namespace forgescan
