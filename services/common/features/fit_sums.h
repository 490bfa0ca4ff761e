// The sums a least-squares fit is made of, taken over all points in one pass.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <span>
#include <vector>

#include "services/common/simd_path.h"

namespace forgescan {

// Where a shape stands: its own axes, in the frame of the points. Units: mm.
struct FitFrame {
  Eigen::Vector3d origin = Eigen::Vector3d::Zero();
  Eigen::Matrix3d axes = Eigen::Matrix3d::Identity();  // columns u, v, w: orthonormal
};

// Sums over the points used, those with |residual| <= the limit. Shape: rows of K unknowns; a row is minus
// the derivative of the residual, so that normal * move = right.
template <int K>
struct NormalSums {
  Eigen::Matrix<double, K, K> normal = Eigen::Matrix<double, K, K>::Zero();
  Eigen::Matrix<double, K, 1> right = Eigen::Matrix<double, K, 1>::Zero();
  double squares = 0;      // of the residuals, mm^2
  double along = 0;        // of the coordinates along w, mm
  std::size_t used = 0;    // points
  std::size_t finite = 0;  // points with a residual at all
  double lowest = 0;       // residual, mm; 0 without points
  double highest = 0;
};

// Residual w, unknowns: height along w, turns that lower it towards u and v (times 1 / per_mm).
struct PlaneSums {
  static constexpr int kUnknowns = 3;
  double per_mm = 1;  // lengths in the rows are multiplied with it, so that all unknowns weigh about the same
};
// About w through the origin. Residual: distance from w less radius. Unknowns: origin along u, v; turns of w
// towards u, v (times 1 / per_mm); radius.
struct CylinderSums {
  static constexpr int kUnknowns = 5;
  double radius_mm = 0;
  double per_mm = 1;
};
// As the cylinder; radius_mm at the origin, and it grows along w with the tangent of the half angle.
// Residual: distance from the surface. The sixth unknown is the half angle (times 1 / per_mm).
struct ConeSums {
  static constexpr int kUnknowns = 6;
  double radius_mm = 0;
  double cosine = 1;  // of the half angle
  double sine = 0;
  double per_mm = 1;
};
// About the origin. Unknowns: origin along u, v, w; radius.
struct SphereSums {
  static constexpr int kUnknowns = 4;
  double radius_mm = 0;
};

// Every sum runs in eight lanes over blocks of fixed size, and the blocks are added in order: the same bytes
// on every path. A point that is not finite is not used. Cost: memory-bound from AVX2 on
// (tests/bench/fit_bench).
template <typename Shape>
NormalSums<Shape::kUnknowns> SumRows(std::span<const Eigen::Vector3d> points, const FitFrame& frame,
                                     const Shape& shape, double limit_mm, SimdPath path = BestSimdPath());

// |residual| of every point; NaN for one that is not finite. Shape: one a point. Units: mm.
template <typename Shape>
std::vector<float> AbsoluteResiduals(std::span<const Eigen::Vector3d> points, const FitFrame& frame,
                                     const Shape& shape, SimdPath path = BestSimdPath());

}  // namespace forgescan
