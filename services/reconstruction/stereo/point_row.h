// Disparities of a few rows -> the points of the middle one. See kernel.h.
#pragma once

#include "services/reconstruction/stereo/kernel.h"
#include "services/reconstruction/stereo/lanes.h"
#include "services/reconstruction/stereo/projector_lanes.h"
#include "services/reconstruction/stereo/raw_block.h"

namespace forgescan {
namespace {

// Sums over the columns of the window, and their moments about its middle row; NaN where a pixel is missing.
FORGESCAN_INLINE void SumColumns(const PointTask& task, int x, int radius) {
  Floats above = Load(task.rows[radius - 1] + x), below = Load(task.rows[radius + 1] + x);
  Floats sum = Load(task.rows[radius] + x) + (above + below), moment = below - above;
  for (int k = 2; k <= radius; ++k) {
    above = Load(task.rows[radius - k] + x), below = Load(task.rows[radius + k] + x);
    sum += above + below;
    moment += static_cast<float>(k) * (below - above);
  }
  Store(task.sums + x, sum);
  Store(task.moments + x, moment);
}

struct Gradient {
  Floats x, y;  // px per px along the raw columns and across the epipolar lines
  Mask known;
};

// Least squares over a window without a missing pixel; known: whether it is that.
FORGESCAN_INLINE Gradient FullGradient(const PointTask& task, int x, int radius) {
  Floats along = Load(task.sums + x + 1) - Load(task.sums + x - 1);
  Floats across = Load(task.moments + x) + (Load(task.moments + x + 1) + Load(task.moments + x - 1));
  float weight = 2;
  for (int k = 2; k <= radius; ++k) {
    along += static_cast<float>(k) * (Load(task.sums + x + k) - Load(task.sums + x - k));
    across += Load(task.moments + x + k) + Load(task.moments + x - k);
    weight += static_cast<float>(2 * k * k);
  }
  const float scale = 1 / (weight * static_cast<float>(2 * radius + 1));
  return {along * scale, across * scale, IsNumber(along) & IsNumber(across)};
}

struct PairSum {
  Floats step = {}, weight = {};

  // Pixels 2 k apart that differ by no more than a surface seen flat would.
  FORGESCAN_INLINE void Add(Floats low, Floats high, Floats slope_limit, float k) {
    const Floats difference = high - low;
    const Mask counts = LessEqual(Magnitude(difference), 2 * k * slope_limit);
    step += Select(counts, k * difference, Floats{});
    weight += Select(counts, All(2 * k * k), Floats{});
  }
};

// Least squares over the symmetric pairs that are there; known: where they are a third of all.
inline __attribute__((noinline)) Gradient PairGradient(const PointTask& task, int x,
                                                       const PointGeometry& geometry) {
  const int radius = geometry.radius_px;
  const Floats limit = geometry.max_slope_per_disparity * Magnitude(Load(task.rows[radius] + x));
  PairSum along, across;
  float least = 0;
  for (int k = 1; k <= radius; ++k) {
    const auto weight = static_cast<float>(k);
    for (int i = -radius; i <= radius; ++i) {
      along.Add(Load(task.rows[radius + i] + x - k), Load(task.rows[radius + i] + x + k), limit, weight);
      across.Add(Load(task.rows[radius - k] + x + i), Load(task.rows[radius + k] + x + i), limit, weight);
    }
    least += 2 * weight * weight * static_cast<float>(2 * radius + 1) / 3;
  }
  return {along.step / along.weight, across.step / across.weight,
          LessEqual(All(least), along.weight) & LessEqual(All(least), across.weight)};
}

FORGESCAN_INLINE Gradient GradientAt(const PointTask& task, int x, Mask wanted, int radius,
                                     const PointGeometry& geometry) {
  Gradient gradient = FullGradient(task, x, radius);
  if (Any(Without(wanted, gradient.known))) {
    const Gradient pairs = PairGradient(task, x, geometry);
    gradient.x = Select(gradient.known, gradient.x, pairs.x);
    gradient.y = Select(gradient.known, gradient.y, pairs.y);
    gradient.known = gradient.known | pairs.known;
  }
  return gradient;
}

// How the rectified column changes along the raw columns, and across the epipolar lines at one raw column.
struct ColumnSlopes {
  Floats along, across;
};

FORGESCAN_INLINE ColumnSlopes SlopesAt(const PointTask& task, int block) {
  const EpipolarBlock& here = task.here[block];
  const EpipolarBlock& above = task.above[block].row_count > 0 ? task.above[block] : here;
  const EpipolarBlock& below = task.below[block].row_count > 0 ? task.below[block] : here;
  const bool has_both = &above != &here && &below != &here;
  const float across = (below.column[0] - above.column[0]) * (has_both ? 0.5F : 1.0F);
  return {here.column[1] + 2 * here.column[2] * LaneNumbers(), All(across)};
}

// rows: the disparities around. Whether the surface falls off faster than the view angle allows from one
// neighbour to the other: the pixel stands on a step. A missing neighbour says nothing.
FORGESCAN_INLINE Mask IsOnStep(const float* const* rows, int x, Floats disparity,
                               const PointGeometry& geometry) {
  const Floats limit = 2 * geometry.max_slope_per_disparity * Magnitude(disparity);
  const Floats along = Magnitude(Load(rows[0] + x + 1) - Load(rows[0] + x - 1));
  const Floats across = Magnitude(Load(rows[1] + x) - Load(rows[-1] + x));
  return Less(limit, along) | Less(limit, across);
}

struct SurfacePoint {
  Floats x, y, z;     // ray, z = 1 times z
  Floats nx, ny, nz;  // towards the camera
  Floats ray_square;  // squared length of the ray to z = 1
  Mask is_steep;
  Mask good;
};

// A plane n.p = c has the disparity (f b / c) n.ray: its gradient over x, y is (b / c) (nx, ny), and n.ray =
// d / f. All of it is multiplied by the slope of the columns, which saves a division.
FORGESCAN_INLINE SurfacePoint PointOf(Floats column, Floats disparity, Floats depth, const Gradient& gradient,
                                      const ColumnSlopes& slopes, const PointGeometry& geometry) {
  const Floats x = column * geometry.inverse_focal;
  const float y = geometry.row_px * geometry.inverse_focal;
  const Floats along_ray = disparity * geometry.inverse_focal * slopes.along;
  const Floats gx = gradient.x;
  const Floats gy = gradient.y * slopes.along - gradient.x * slopes.across;
  const Floats gz = along_ray - gx * x - gy * y;
  const Floats square = gx * gx + gy * gy + gz * gz;
  const Floats ray_square = x * x + (y * y + 1);
  const Floats length = Select(Less(Floats{}, along_ray), All(-1), All(1)) / Sqrt(square);
  return {.x = depth * x,
          .y = depth * y,
          .z = depth,
          .nx = gx * length,
          .ny = gy * length,
          .nz = gz * length,
          .ray_square = ray_square,
          .is_steep = Less(along_ray * along_ray, geometry.squared_min_cosine * square * ray_square),
          .good = FromBits(0)};
}

// Those of the points that the projector could have lit by the column they show; notes by how much they are
// off.
inline __attribute__((noinline)) Mask CheckWithProjector(const PointTask& task, int x,
                                                         const SurfacePoint& point,
                                                         const PointGeometry& geometry, PointRow& points) {
  const ProjectorModel& model = *geometry.projector;
  const Floats shown = geometry.sign * Load(task.left->coordinate_px + x);
  const Floats residual = shown - ProjectorColumn(model, point.x, point.y, point.z);
  Store(points.residual_px + points.residual_count, Packed(point.good, residual));
  points.residual_count += static_cast<int>(Count(point.good));
  const Floats variance = Load(task.left->variance_px2 + x);
  const Floats square = residual * residual;
  const Mask lit = LessEqual(square, All(model.max_residual_px * model.max_residual_px)) |
                   LessEqual(square, model.max_residual_sigma * model.max_residual_sigma * variance);
  points.projector += Count(Without(point.good, lit));
  return point.good & lit;
}

// Those that are good, one behind the other.
FORGESCAN_INLINE void AddPoints(Mask good, SurfacePoint point, Floats sigma, Floats coordinate,
                                PointRow& points) {
  if (Bits(good) != 0xffff) {  // nearly all blocks are full
    for (Floats* const value :
         {&point.x, &point.y, &point.z, &point.nx, &point.ny, &point.nz, &sigma, &coordinate}) {
      *value = Packed(good, *value);
    }
  }
  const int at = points.count;
  StoreTriples(points.points_mm.values + 3 * at, point.x, point.y, point.z);
  StoreTriples(points.normals.values + 3 * at, point.nx, point.ny, point.nz);
  Store(points.sigma_mm.values + at, sigma);
  Store(points.coordinate_px + at, coordinate);
  points.count += static_cast<int>(Count(good));
}

FORGESCAN_INLINE void PointBlock(const PointTask& task, int block, int radius, const PointGeometry& geometry,
                                 PointRow& points) {
  const int x = block * kLanes;
  const Floats disparity = Load(task.rows[radius] + x);
  const Mask matched = IsNumber(disparity);
  const Floats inverse_disparity = 1 / disparity, depth = geometry.focal_times_baseline * inverse_disparity;
  const Mask in_range =
      matched & LessEqual(All(geometry.min_depth_mm), depth) & LessEqual(depth, All(geometry.max_depth_mm));
  const Gradient gradient = GradientAt(task, x, in_range, radius, geometry);
  const Mask has_normal = in_range & gradient.known;
  SurfacePoint point =
      PointOf(Load(task.left->column_px + x), disparity, depth, gradient, SlopesAt(task, block), geometry);
  point.good = Without(has_normal, point.is_steep | IsOnStep(task.rows + radius, x, disparity, geometry));
  Mask good = point.good;
  if (geometry.projector != nullptr) {
    const SurfacePoint passed = point;  // so that the point itself never has to be in memory
    good = CheckWithProjector(task, x, passed, geometry, points);
  }
  const Floats variance = Load(task.disparity->variance_px2 + x);
  const Floats sigma = Magnitude(depth * inverse_disparity) * Sqrt(variance * point.ray_square);
  AddPoints(good, point, sigma, Load(task.left->coordinate_px + x), points);
  points.depth_range += Count(Without(matched, in_range));
  points.no_normal += Count(Without(in_range, has_normal));
  points.steep += Count(Without(has_normal, point.good));
}

FORGESCAN_INLINE void StreamArray(std::ptrdiff_t ready, PointArray& array) {
  for (; array.target != nullptr && array.streamed + kLanes <= ready; array.streamed += kLanes) {
    StoreLine(array.target + array.streamed, Load(array.values + array.streamed));
  }
}

FORGESCAN_INLINE void StreamPoints(std::ptrdiff_t ready, PointRow& points) {
  StreamArray(3 * ready, points.points_mm);
  StreamArray(3 * ready, points.normals);
  StreamArray(ready, points.sigma_mm);
}

FORGESCAN_INLINE void PointBlocks(const PointTask& task, int radius, const PointGeometry& geometry,
                                  PointRow& points) {
  constexpr int kAhead = 2;  // blocks: what was stored a moment ago cannot be read again at once
  const auto matched = [&](int block) -> std::uint64_t {
    return Bits(IsNumber(Load(task.rows[radius] + block * kLanes)));
  };
  int ready = 0;                            // points a block ago: only they are streamed, for the same reason
  std::uint64_t window = matched(0) << 48;  // of this block, from bit 0, and the next three
  for (int block = -kAhead; block < task.blocks; ++block) {
    window = window >> 16 | matched(block + kAhead + 1) << 48;
    if (window >> 16 != 0) {  // a window of the middle row can reach these columns
      SumColumns(task, (block + kAhead) * kLanes, radius);
    }
    if (block >= 0) {
      FetchAhead(task.next, block);
    }
    if ((window & 0xffff) != 0) {
      PointBlock(task, block, radius, geometry, points);
    }
    StreamPoints(ready, points);
    ready = points.count;
  }
  StreamPoints(points.count, points);
}

inline void TriangulateRow(const PointTask& task, const PointGeometry& geometry, PointRow& points) {
  constexpr int kUsual = 3;  // with its loops unrolled
  if (geometry.radius_px == kUsual) {
    PointBlocks(task, kUsual, geometry, points);
  } else {
    PointBlocks(task, geometry.radius_px, geometry, points);
  }
}

}  // namespace
}  // namespace forgescan
