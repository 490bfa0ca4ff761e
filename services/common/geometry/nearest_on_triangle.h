// The nearest point of one triangle. DeviationSurface has its own form for many triangles at once
// (deviation_surface.cc).
#pragma once

#include <Eigen/Geometry>
#include <algorithm>

namespace forgescan {

// Nearest point to p of the triangle a + s ab + t ac (regions of the plane as in Ericson, Real-Time Collision
// Detection, 5.1.5) with that unit normal, or zero where it has no area. Over the triangle it is the foot of
// the perpendicular: by s and t, the rounding of a triangle 1800 mm long and 70 mm wide would be 0.6 mm. The
// regions are told apart in double precision: in single precision a point 8 mm beside a triangle 1800 mm long
// and 0.01 mm wide would count as over it.
inline Eigen::Vector3f NearestOnTriangle(const Eigen::Vector3f& p, const Eigen::Vector3f& a,
                                         const Eigen::Vector3f& ab, const Eigen::Vector3f& ac,
                                         const Eigen::Vector3f& normal) {
  constexpr double kNoLength = 1e-30;  // mm^2
  const Eigen::Vector3d b = ab.cast<double>(), c = ac.cast<double>();  // from a, as all that follows
  const Eigen::Vector3d ap = p.cast<double>() - a.cast<double>();
  const double d1 = b.dot(ap), d2 = c.dot(ap);
  if (d1 <= 0 && d2 <= 0) return a;
  const auto from_a = [&](const Eigen::Vector3d& q) -> Eigen::Vector3f {
    return (a.cast<double>() + q).cast<float>();
  };
  const Eigen::Vector3d bp = ap - b;
  const double d3 = b.dot(bp), d4 = c.dot(bp);
  if (d3 >= 0 && d4 <= d3) return from_a(b);
  const double vc = d1 * d4 - d3 * d2;
  if (vc <= 0 && d1 >= 0 && d3 <= 0) return from_a(b * (d1 / std::max(d1 - d3, kNoLength)));
  const Eigen::Vector3d cp = ap - c;
  const double d5 = b.dot(cp), d6 = c.dot(cp);
  if (d6 >= 0 && d5 <= d6) return from_a(c);
  const double vb = d5 * d2 - d1 * d6;
  if (vb <= 0 && d2 >= 0 && d6 <= 0) return from_a(c * (d2 / std::max(d2 - d6, kNoLength)));
  const double va = d3 * d6 - d5 * d4;
  if (va <= 0 && d4 - d3 >= 0 && d5 - d6 >= 0) {
    return from_a(b + (c - b) * ((d4 - d3) / std::max((d4 - d3) + (d5 - d6), kNoLength)));
  }
  if (normal.isZero(0)) return a;
  return p - normal * normal.dot(p - a);
}

}  // namespace forgescan
