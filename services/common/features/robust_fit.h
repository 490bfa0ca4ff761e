// Least squares with rejection of outliers, the same for every kind of feature.
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <limits>
#include <span>
#include <vector>

#include "services/common/features/fit_sums.h"
#include "services/common/result.h"

namespace forgescan {

struct RobustOptions {
  double reject_sigmas = 3;  // k; sigma is 1.4826 times the median of the absolute residuals
  int max_rounds = 10;
  double max_rejected_share = 0.5;  // above, the points are of another shape
  std::size_t min_points = 10;  // used: twice the unknowns of a cylinder; fewer always fit, whatever they are
  double max_form_share = 0.05;    // sigma against the size of the shape; above, it is another shape
  double max_form_sigma_mm = 0.5;  // however large the shape: forged faces are some 0.1 mm rough
};

// Errors: kInvalidArgument with name, value and allowed range of the first wrong option.
Status Check(const RobustOptions& options);

// How a feature came out of its points. Shape: points = used + rejected.
struct FitQuality {
  std::size_t points = 0;
  std::size_t rejected = 0;
  double sigma_mm = 0;  // standard deviation of the residuals of the points used
  double limit_mm = 0;  // points with a larger residual were rejected
  double range_mm = 0;  // form error: highest less lowest residual of the points used

  std::size_t used() const { return points - rejected; }
  double rejected_share() const {
    return points > 0 ? static_cast<double>(rejected) / static_cast<double>(points) : 0;
  }
};

// k * 1.4826 * median |residual|, at least the rounding of single-precision points. A NaN counts as farthest.
double RejectionLimit(std::span<const float> absolute_residuals, double reject_sigmas);

// One point in each of `count` equal stretches of their order, at an uneven place in it, so that the sample
// does not fall into step with the rows of a scan. All points if there are not more than that.
std::vector<Eigen::Vector3d> EvenSample(std::span<const Eigen::Vector3d> points, std::size_t count);

// Thickness of the thinnest shell along the feature that holds 95 % of the points used (ISO 10360-13 names
// it D95%). Shape: signed residuals of the points used, at least 1. Units: mm.
double ThinnestShellMm(std::vector<double> residuals);

// The same of a fitted shape's points; 0 if it used none. Shape: Residual(point) and quality.
template <typename Shape>
double ThinnestShellMm(std::span<const Eigen::Vector3d> points, const Shape& shape) {
  std::vector<double> residuals;
  for (const Eigen::Vector3d& p : points) {
    const double residual = shape.Residual(p);
    if (std::abs(residual) <= shape.quality.limit_mm) residuals.push_back(residual);
  }
  return residuals.empty() ? 0 : ThinnestShellMm(std::move(residuals));
}

// Errors: kInvalidArgument for fewer points than `needed`, or (naming the first) one that is not finite.
Status CheckCount(std::span<const Eigen::Vector3d> points, std::size_t needed, const char* feature);
Status CheckFinite(std::span<const Eigen::Vector3d> points);

// Errors: kUntrusted if fewer than min_points are used, or if their residuals are no longer small against
// size_mm (the radius, or the smaller spread of a plane's points) and max_form_sigma_mm: the points are of
// another shape.
Status CheckForm(const FitQuality& quality, double size_mm, const RobustOptions& options,
                 const char* feature);

// Errors: kDegenerate if the height of the piece of circle that is seen over its chord does not stand clear
// of the scatter. Purpose: that height is all that tells the radius; noise of its order has a radius of its
// own, wrong by an amount that more points do not reduce, and that no covariance tells. half_arc_rad: half
// the angle seen from the centre.
Status CheckSagitta(const FitQuality& quality, double radius_mm, double half_arc_rad, const char* feature);

// Errors: kUntrusted if too many points were rejected.
Result<FitQuality> Describe(std::size_t points, std::size_t used, double sigma_mm,
                            const RobustOptions& options);

inline constexpr std::size_t kStartPoints = 4096;  // the start is found with as many of the points
inline constexpr int kMaxFitSteps = 60;
inline constexpr double kSettledShare = 1e-9;  // of the size: a step below is rounding
// Steps end when they move the shape by less than this share of its own standard uncertainty: the start need
// not be exact, and the end is as exact as anything said of it.
inline constexpr double kStartEnough = 0.1;
inline constexpr double kEnough = 0.01;
inline constexpr double kSameLimitShare = 1e-3;

template <typename Model>
double Variance(const NormalSums<Model::kUnknowns>& sums) {
  return sums.squares / std::max(1.0, static_cast<double>(sums.used) - Model::kUnknowns);
}

// One pass and one Gauss-Newton step; whether it was so small that no more are needed. Errors: Move()'s.
template <typename Model>
Result<bool> StepOnce(std::span<const Eigen::Vector3d> points, double limit_mm, double enough, Model& model,
                      NormalSums<Model::kUnknowns>& sums) {
  sums = model.Sum(points, limit_mm);
  ASSIGN_OR_RETURN(const double gain_mm2, model.Move(sums));
  sums.squares = std::max(0.0, sums.squares - gain_mm2);
  const double moved_mm = std::sqrt(std::max(0.0, gain_mm2) / static_cast<double>(sums.used));
  return moved_mm <= kSettledShare * model.SizeMm() || gain_mm2 <= enough * enough * Variance<Model>(sums);
}

// Errors: Move()'s; kNotConverged.
template <typename Model>
Result<NormalSums<Model::kUnknowns>> Settle(std::span<const Eigen::Vector3d> points, double limit_mm,
                                            double enough, Model& model) {
  NormalSums<Model::kUnknowns> sums;
  for (int step = 0; step < kMaxFitSteps; ++step) {
    ASSIGN_OR_RETURN(const bool settled, StepOnce(points, limit_mm, enough, model, sums));
    if (settled) return sums;
  }
  return Fail(ErrorCode::kNotConverged, "the {} through {} points did not settle in {} steps", Model::kName,
              points.size(), kMaxFitSteps);
}

// The limit beyond which a point is no part of the shape, found with the points given, and the shape with it:
// every round judges all of them anew, so that a point dropped early can come back.
template <typename Model>
Result<double> FindLimit(std::span<const Eigen::Vector3d> points, const RobustOptions& options,
                         Model& model) {
  constexpr double kEverything = std::numeric_limits<double>::infinity();
  if (const auto start = Settle(points, kEverything, kStartEnough, model); !start.ok()) return start.error();
  double limit_mm = kEverything;
  for (int round = 0; round < options.max_rounds; ++round) {
    const double next_mm = RejectionLimit(model.Residuals(points), options.reject_sigmas);
    const bool same = std::abs(next_mm - limit_mm) <= kSameLimitShare * limit_mm;
    limit_mm = next_mm;
    NormalSums<Model::kUnknowns> sums;
    ASSIGN_OR_RETURN(const bool settled, StepOnce(points, limit_mm, kStartEnough, model, sums));
    if (same && settled) break;
  }
  return limit_mm;
}

// Purpose: least squares without what lies beyond k sigma. Shape and limit are found with a sample of the
// points, then the shape is refined with all of them, which takes two or three passes. Model, a shape that
// has a start: kUnknowns; kName; SizeMm(); Sum(points, limit) and Residuals(points) as SumRows() and
// AbsoluteResiduals(); Move(sums) -> Result<double>, one Gauss-Newton step, how much it takes from the sum of
// squares (mm^2). Returns the sums of the last pass, their squares those after its step. Errors: Move()'s;
// kInvalidArgument for a point that is not finite; kUntrusted if too many points were rejected.
template <typename Model>
Result<FitQuality> FitRobust(std::span<const Eigen::Vector3d> points, const RobustOptions& options,
                             Model& model) {
  RETURN_IF_ERROR(Check(options));
  const std::vector<Eigen::Vector3d> sample = EvenSample(points, kStartPoints);
  const auto limit_mm = FindLimit(std::span(sample), options, model);
  if (!limit_mm.ok()) {
    RETURN_IF_ERROR(CheckFinite(points));
    return limit_mm.error();
  }
  const auto sums = Settle(points, *limit_mm, kEnough, model);
  if (!sums.ok() || sums->finite < points.size()) RETURN_IF_ERROR(CheckFinite(points));
  if (!sums.ok()) return sums.error();
  ASSIGN_OR_RETURN(FitQuality quality,
                   Describe(points.size(), sums->used, std::sqrt(Variance<Model>(*sums)), options));
  quality.limit_mm = *limit_mm;
  quality.range_mm = sums->highest - sums->lowest;
  return quality;
}

}  // namespace forgescan
