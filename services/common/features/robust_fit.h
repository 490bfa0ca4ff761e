// Least squares with rejection of outliers, the same for every kind of feature.
#pragma once

#include <Eigen/Core>
#include <cmath>
#include <span>
#include <vector>

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

  std::size_t used() const { return points - rejected; }
  double rejected_share() const {
    return points > 0 ? static_cast<double>(rejected) / static_cast<double>(points) : 0;
  }
};

// k * 1.4826 * median |residual|, at least the rounding of single-precision points. Moves the values about.
double RejectionLimit(std::vector<double>& absolute_residuals, double reject_sigmas);

// Errors: kInvalidArgument for a point that is not finite, or fewer points than `needed`.
Status CheckPoints(std::span<const Eigen::Vector3d> points, std::size_t needed, const char* feature);

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

// Purpose: drop what lies beyond k sigma and refit, until none is left or max_rounds: every round judges all
// points anew, so that a point dropped early can come back. Fit: (points used, shape before or nullptr) ->
// Result<Shape>; Shape: double Residual(point) const and FitQuality quality; kUnknowns. Errors: those of the
// fit; kUntrusted if too many points were rejected.
template <typename Shape, typename Fit>
Result<Shape> FitRobust(std::span<const Eigen::Vector3d> points, const RobustOptions& options,
                        const Fit& fit) {
  RETURN_IF_ERROR(Check(options));
  std::vector<Eigen::Vector3d> used(points.begin(), points.end());
  ASSIGN_OR_RETURN(Shape shape, fit(used, static_cast<const Shape*>(nullptr)));
  std::vector<double> residuals(points.size()), sorted;
  for (int round = 0; round < options.max_rounds; ++round) {
    for (std::size_t i = 0; i < points.size(); ++i) residuals[i] = std::abs(shape.Residual(points[i]));
    sorted = residuals;
    const double limit = RejectionLimit(sorted, options.reject_sigmas);
    std::vector<Eigen::Vector3d> next;
    next.reserve(points.size());
    for (std::size_t i = 0; i < points.size(); ++i) {
      if (residuals[i] <= limit) next.push_back(points[i]);
    }
    const bool unchanged = next.size() == used.size() && round > 0;
    used.swap(next);
    if (unchanged) break;
    ASSIGN_OR_RETURN(shape, fit(used, &shape));
  }
  double squares = 0;
  for (const Eigen::Vector3d& p : used) squares += shape.Residual(p) * shape.Residual(p);
  const double freedom = std::max(1.0, static_cast<double>(used.size()) - Shape::kUnknowns);
  if (static_cast<double>(points.size() - used.size()) >
      options.max_rejected_share * static_cast<double>(points.size())) {
    return Fail(ErrorCode::kUntrusted,
                "{} of {} points were rejected, at most {:.0f} % may be: they are of another shape",
                points.size() - used.size(), points.size(), 100 * options.max_rejected_share);
  }
  shape.quality = {points.size(), points.size() - used.size(), std::sqrt(squares / freedom)};
  return shape;
}

}  // namespace forgescan
