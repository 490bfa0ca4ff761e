#include "services/common/features/deviation_surface.h"

#include <xmmintrin.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "services/common/parallel_blocks.h"
#include "services/common/simd_target.h"

// Compiled with -ffp-contract=off: a fused product would differ between the paths.

namespace forgescan {
namespace {

#define FORGESCAN_INLINE [[gnu::always_inline]] inline

// Triangles that share the nearest edge give distances that differ by rounding only: a share of the squared
// distance, and the square of what coordinates differ by at a triangle.
constexpr float kTieShare = 1e-5F;
constexpr float kTie_mm2 = 1e-9F;
constexpr float kFar_mm = 64;  // times the rounding of a float: 4e-6 mm
constexpr std::size_t kBlock = 2048;
constexpr std::size_t kStack = 128;  // 16 levels of at most 7 brothers

using Lanes = float __attribute__((vector_size(32)));
using Mask = int __attribute__((vector_size(32)));

FORGESCAN_INLINE Lanes Load(const float (&from)[8]) { return *reinterpret_cast<const Lanes*>(from); }
FORGESCAN_INLINE Lanes Least(Lanes x, Lanes y) { return x < y ? x : y; }
FORGESCAN_INLINE Lanes Most(Lanes x, Lanes y) { return x > y ? x : y; }

struct Point {
  Lanes x, y, z;
};
FORGESCAN_INLINE Point Load(const float (&from)[3][8]) {
  return {Load(from[0]), Load(from[1]), Load(from[2])};
}
FORGESCAN_INLINE Point operator-(const Point& a, const Point& b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
FORGESCAN_INLINE Lanes Dot(const Point& a, const Point& b) { return (a.x * b.x + a.y * b.y) + a.z * b.z; }

// Squared distance from the segment that starts at the origin; point seen from there.
FORGESCAN_INLINE Lanes FromSide(const Point& point, const Point& side, Lanes inverse) {
  const Lanes share = Least(Most(Dot(point, side) * inverse, Lanes{}), Lanes{} + 1.0F);
  const Point off{point.x - share * side.x, point.y - share * side.y, point.z - share * side.z};
  return Dot(off, off);
}

// One bit a lane.
FORGESCAN_INLINE unsigned Bits(Mask mask) {
  union {
    Mask all;
    __m128 half[2];
  } parts{mask};
  const int low = _mm_movemask_ps(parts.half[0]), high = _mm_movemask_ps(parts.half[1]);
  return static_cast<unsigned>(low) | static_cast<unsigned>(high) << 4;
}

FORGESCAN_INLINE float LeastOf(Lanes x) {
  x = Least(x, __builtin_shufflevector(x, x, 4, 5, 6, 7, 0, 1, 2, 3));
  x = Least(x, __builtin_shufflevector(x, x, 2, 3, 0, 1, 6, 7, 4, 5));
  return x[0] < x[1] ? x[0] : x[1];
}

FORGESCAN_INLINE float WithTies(float squared) { return squared + (squared * kTieShare + kTie_mm2); }

}  // namespace

// One block of points against the surface.
struct DeviationQuery {
  using Leaf = DeviationSurface::Leaf;
  using Node = DeviationSurface::Node;

  const Leaf* leaves;
  const Node* nodes;
  const DeviationSurface::Grid& grid;
  std::span<const Eigen::Vector3f> points;
  std::span<float> deviations_mm;
  float max_squared;

  struct Best {
    float squared;     // nothing beyond is of interest
    float held = 0;    // of the triangle that gives the sign: it and the nearest one are equally near
    float height = 0;  // over its plane
    std::int32_t leaf = -1;
    int lane = 0;
  };
  struct Entry {
    float squared;
    std::int32_t child;
  };

  FORGESCAN_INLINE static void VisitLeaf(const Leaf& leaf, std::int32_t number, const Point& p, Best& best) {
    const Point arm = p - Load(leaf.corner), ab = Load(leaf.ab), ac = Load(leaf.ac);
    const Lanes height = Dot(arm, Load(leaf.normal));
    const Lanes to_b = Dot(arm, Load(leaf.to_b)), to_c = Dot(arm, Load(leaf.to_c));
    const Mask inside = (to_b >= 0.0F) & (to_c >= 0.0F) & (to_b + to_c <= 1.0F);
    const Lanes side =
        Least(Least(FromSide(arm, ab, Load(leaf.inverse_ab)), FromSide(arm, ac, Load(leaf.inverse_ac))),
              FromSide(arm - ab, ac - ab, Load(leaf.inverse_bc)));
    const Lanes squared = inside ? height * height : side;
    const float least = LeastOf(squared);
    if (!(least <= WithTies(best.squared))) return;
    // Of those that are equally near, the one that the point is highest over.
    best.squared = least < best.squared ? least : best.squared;
    if (best.held > WithTies(best.squared)) best.leaf = -1;
    alignas(32) float squares[8], heights[8];
    *reinterpret_cast<Lanes*>(squares) = squared;
    *reinterpret_cast<Lanes*>(heights) = height;
    for (unsigned bits = Bits(squared <= WithTies(best.squared)); bits != 0; bits &= bits - 1) {
      const int lane = __builtin_ctz(bits);
      if (best.leaf < 0 || std::abs(heights[lane]) > std::abs(best.height)) {
        best.held = squares[lane];
        best.height = heights[lane];
        best.leaf = number;
        best.lane = lane;
      }
    }
  }

  // Puts the node's children that may hold something nearer on the stack, the nearest on top of all from
  // `bottom` on.
  FORGESCAN_INLINE static std::size_t Open(const Node& node, const Point& p, float bound, Entry* stack,
                                           std::size_t depth, std::size_t bottom) {
    const Point below = Load(node.low) - p, above = p - Load(node.high);
    const Point off{Most(Most(below.x, above.x), Lanes{}), Most(Most(below.y, above.y), Lanes{}),
                    Most(Most(below.z, above.z), Lanes{})};
    const Lanes squared = Dot(off, off);
    alignas(32) float squares[8];
    *reinterpret_cast<Lanes*>(squares) = squared;
    for (unsigned bits = Bits(squared <= bound); bits != 0; bits &= bits - 1) {
      const int lane = __builtin_ctz(bits);
      std::size_t at = depth++;
      for (; at > bottom && stack[at - 1].squared < squares[lane]; --at) stack[at] = stack[at - 1];
      stack[at] = {squares[lane], node.child[lane]};
    }
    return depth;
  }

  FORGESCAN_INLINE static bool IsFarFromCorner(const Leaf& leaf, int lane, const float* p) {
    return std::abs(p[0] - leaf.corner[0][lane]) + std::abs(p[1] - leaf.corner[1][lane]) +
               std::abs(p[2] - leaf.corner[2][lane]) >
           kFar_mm;
  }

  // On a triangle that long single precision no longer gives the last 0.0001 mm.
  static float PreciseDeviation(const Leaf& leaf, int lane, const Eigen::Vector3f& point);

  // Where the search begins: with the leaves near the point's cell, or with the root.
  FORGESCAN_INLINE std::size_t Begin(const float* place, const Point& p, float bound, Entry* stack) const {
    const std::ptrdiff_t at = PlaceInGrid(place);
    const std::int32_t number = at >= 0 ? grid.cell_at[static_cast<std::size_t>(at)] : -1;
    if (number < 0) return Open(nodes[0], p, bound, stack, 0, 0);
    const DeviationSurface::Cell& cell = grid.cells[static_cast<std::size_t>(number)];
    const float x = place[0] - cell.middle[0], y = place[1] - cell.middle[1], z = place[2] - cell.middle[2];
    const auto along = [&](const float* axis) {
      return Lanes{} + ((axis[0] * x + axis[1] * y) + axis[2] * z);
    };
    const Point local{along(cell.axes), along(cell.axes + 3), along(cell.axes + 6)};
    // Nothing nearer than `bound` lies farther from the middle than this.
    const float reach_mm = __builtin_sqrtf(bound) + __builtin_sqrtf((x * x + y * y) + z * z);
    std::size_t depth = 0;
    for (std::uint32_t i = cell.first; i < cell.last && grid.nearest_mm[i] <= reach_mm; ++i) {
      depth = Open(grid.nodes[i], local, bound, stack, depth, 0);
    }
    return depth;
  }

  // -1 outside the grid.
  FORGESCAN_INLINE std::ptrdiff_t PlaceInGrid(const float* place) const {
    std::ptrdiff_t cell = 0;
    for (int i = 2; i >= 0; --i) {
      const float at = (place[i] - grid.low.data()[i]) * grid.cells_per_mm;
      if (!(at >= 0 && at < static_cast<float>(grid.count[static_cast<std::size_t>(i)]))) return -1;
      cell = cell * grid.count[static_cast<std::size_t>(i)] + static_cast<std::ptrdiff_t>(at);
    }
    return cell;
  }

  FORGESCAN_INLINE Best Find(const Eigen::Vector3f& point, std::int32_t hint) const {
    const Point p{Lanes{} + point.data()[0], Lanes{} + point.data()[1], Lanes{} + point.data()[2]};
    Best best{max_squared};
    if (hint >= 0) VisitLeaf(leaves[hint], hint, p, best);
    std::array<Entry, kStack> stack;
    std::size_t depth = Begin(point.data(), p, WithTies(best.squared), stack.data());
    while (depth > 0) {
      const Entry entry = stack[--depth];
      if (entry.squared > WithTies(best.squared)) continue;
      if (entry.child >= 0) {
        depth = Open(nodes[entry.child], p, WithTies(best.squared), stack.data(), depth, depth);
      } else if (~entry.child != hint) {
        VisitLeaf(leaves[~entry.child], ~entry.child, p, best);
      }
    }
    return best;
  }

  FORGESCAN_INLINE void Run() const {
    std::int32_t hint = -1;
    for (std::size_t i = 0; i < points.size(); ++i) {
      const float* p = points[i].data();
      deviations_mm[i] = std::numeric_limits<float>::quiet_NaN();
      if (!(std::abs(p[0]) + std::abs(p[1]) + std::abs(p[2]) < std::numeric_limits<float>::max())) continue;
      const Best best = Find(points[i], hint);
      if (best.leaf < 0) continue;
      hint = best.leaf;
      deviations_mm[i] = IsFarFromCorner(leaves[best.leaf], best.lane, p)
                             ? PreciseDeviation(leaves[best.leaf], best.lane, points[i])
                             : __builtin_copysignf(__builtin_sqrtf(best.squared), best.height);
    }
  }

  FORGESCAN_TARGET_AVX2 void RunAvx2() const { Run(); }
};

float DeviationQuery::PreciseDeviation(const Leaf& leaf, int lane, const Eigen::Vector3f& point) {
  const auto take = [lane](const float(&from)[3][8]) {
    return Eigen::Vector3d(from[0][lane], from[1][lane], from[2][lane]);
  };
  const Eigen::Vector3d arm = point.cast<double>() - take(leaf.corner), ab = take(leaf.ab),
                        ac = take(leaf.ac);
  const Eigen::Vector3d cross = ab.cross(ac);
  const double area = cross.norm(), height = area > 0 ? arm.dot(cross) / area : 0;
  const double to_b = arm.dot(ac.cross(cross)), to_c = arm.dot(cross.cross(ab));
  if (area > 0 && to_b >= 0 && to_c >= 0 && to_b + to_c <= area * area) return static_cast<float>(height);
  const auto from_side = [](const Eigen::Vector3d& from, const Eigen::Vector3d& side) {
    const double share = std::clamp(from.dot(side) / std::max(side.squaredNorm(), 1e-30), 0.0, 1.0);
    return (from - share * side).norm();
  };
  const double side = std::min({from_side(arm, ab), from_side(arm, ac), from_side(arm - ab, ac - ab)});
  return static_cast<float>(std::copysign(side, height));
}

void DeviationSurface::Deviations(std::span<const Eigen::Vector3f> points, float max_distance_mm,
                                  std::span<float> deviations_mm, SimdPath path) const {
  if (!(max_distance_mm >= 0)) {
    std::fill(deviations_mm.begin(), deviations_mm.end(), std::numeric_limits<float>::quiet_NaN());
    return;
  }
  const DeviationQuery query{leaves_.data(), nodes_.data(), grid_,
                             points,         deviations_mm, max_distance_mm * max_distance_mm};
  if (path == SimdPath::kPlain) return query.Run();
  query.RunAvx2();
}

std::vector<float> SignedDeviations(const PointCloud& cloud_in_model, const DeviationSurface& surface,
                                    double max_distance_mm, unsigned threads) {
  std::vector<float> deviations(cloud_in_model.size());
  const std::span<const Eigen::Vector3f> points(cloud_in_model.points);
  ForEachBlock(points.size(), kBlock, threads, [&](std::size_t, std::size_t begin, std::size_t end) {
    surface.Deviations(points.subspan(begin, end - begin), static_cast<float>(max_distance_mm),
                       std::span(deviations).subspan(begin, end - begin));
  });
  return deviations;
}

}  // namespace forgescan
