// The nearest point of one triangle, in single precision. DeviationSurface has its own form for many
// triangles at once (deviation_surface.cc).
#pragma once

#include <Eigen/Geometry>
#include <algorithm>

namespace forgescan {

// Nearest point to p of the triangle a + s ab + t ac (regions of the plane as in Ericson, Real-Time Collision
// Detection, 5.1.5) with that unit normal, or zero where it has no area. Over the triangle it is the foot of
// the perpendicular: by s and t, the rounding of a triangle 1800 mm long and 70 mm wide would be 0.6 mm.
inline Eigen::Vector3f NearestOnTriangle(const Eigen::Vector3f& p, const Eigen::Vector3f& a,
                                         const Eigen::Vector3f& ab, const Eigen::Vector3f& ac,
                                         const Eigen::Vector3f& normal) {
  const Eigen::Vector3f ap = p - a;
  const float d1 = ab.dot(ap), d2 = ac.dot(ap);
  if (d1 <= 0 && d2 <= 0) return a;
  const Eigen::Vector3f bp = ap - ab;
  const float d3 = ab.dot(bp), d4 = ac.dot(bp);
  if (d3 >= 0 && d4 <= d3) return a + ab;
  const float vc = d1 * d4 - d3 * d2;
  if (vc <= 0 && d1 >= 0 && d3 <= 0) return a + ab * (d1 / std::max(d1 - d3, 1e-30F));
  const Eigen::Vector3f cp = ap - ac;
  const float d5 = ab.dot(cp), d6 = ac.dot(cp);
  if (d6 >= 0 && d5 <= d6) return a + ac;
  const float vb = d5 * d2 - d1 * d6;
  if (vb <= 0 && d2 >= 0 && d6 <= 0) return a + ac * (d2 / std::max(d2 - d6, 1e-30F));
  const float va = d3 * d6 - d5 * d4;
  if (va <= 0 && d4 - d3 >= 0 && d5 - d6 >= 0) {
    const float along = (d4 - d3) / std::max((d4 - d3) + (d5 - d6), 1e-30F);
    return a + ab + (ac - ab) * along;
  }
  if (normal.isZero(0)) return a;
  return p - normal * normal.dot(ap);
}

}  // namespace forgescan
