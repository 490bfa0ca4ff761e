// Signed distances of many points to the design surface.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "services/common/simd_path.h"
#include "services/common/geometry/point_cloud.h"
#include "services/common/geometry/triangle_index.h"
#include "services/common/result.h"

namespace forgescan {

// Purpose: the deviation of every point of a scan. Same distances as TriangleIndex, made for points that come
// in the order of a scan: eight triangles or eight boxes at a time, a grid that tells what is near, and the
// neighbours of the last point first. Shape: any number of triangles >= 1, connected or not. Units: mm.
// Frames: that of the vertices. Precision: that of single-precision coordinates.
class DeviationSurface {
 public:
  // Errors: kInvalidArgument for no triangles, a vertex number out of range, or a vertex that is not finite.
  // Triangles without area stay: their edges are still part of the surface.
  static Result<DeviationSurface> Build(const std::vector<Eigen::Vector3f>& vertices,
                                        const std::vector<TriangleCorners>& triangles);

  // Entry i of deviations_mm: signed distance of points[i] to the nearest triangle, + on the side its normal
  // points to; NaN where there is none within max_distance_mm, and for a point that is not finite. Where
  // several triangles are equally near, as at an edge, the one that faces the point most decides the sign.
  // The spans are of one size. Equal bytes on every path.
  void Deviations(std::span<const Eigen::Vector3f> points, float max_distance_mm,
                  std::span<float> deviations_mm, SimdPath path = BestSimdPath()) const;

 private:
  static constexpr std::size_t kWidth = 8;
  friend struct DeviationQuery;

  // Eight triangles, coordinate by coordinate. A lane without a triangle lies far away.
  struct alignas(32) Leaf {
    float corner[3][kWidth], ab[3][kWidth], ac[3][kWidth];
    float normal[3][kWidth];  // unit; 0 for a triangle without area
    float to_b[3][kWidth],
        to_c[3][kWidth];  // times (point - corner): its share of ab and ac; NaN without area
    float inverse_ab[kWidth], inverse_ac[kWidth], inverse_bc[kWidth];  // of the squared lengths; 0 for 0
  };
  // Eight boxes. An empty lane is a box that no point is near.
  struct alignas(32) Node {
    float low[3][kWidth], high[3][kWidth];
    std::int32_t child[kWidth];  // >= 0: node; < 0: leaf, its complement
  };
  // What can be nearest to a point of one cell of a grid: leaves, eight a node, as boxes in a frame that lies
  // along the surface there, so that they are flat. The nearest to the cell's middle come first.
  struct Cell {
    float middle[3], axes[9];   // the frame: row by row, from the middle of the cell
    std::uint32_t first, last;  // of the nodes
  };
  struct Grid {
    Eigen::Vector3f low = Eigen::Vector3f::Zero();
    float cells_per_mm = 0;
    std::array<int, 3> count{};         // zero: no grid
    std::vector<std::int32_t> cell_at;  // by place, x first; -1: ask the tree
    std::vector<Cell> cells;
    std::vector<Node> nodes;
    std::vector<float> nearest_mm;  // entry i: from the middle to the nearest box of node i
  };
  struct Range {
    std::size_t begin, end;
  };
  class Builder;
  class GridBuilder;
  Grid MakeGrid() const;

  static constexpr float kFarAway_mm = 1e18F;  // its square is still a number

  std::vector<Leaf> leaves_;
  std::vector<Node> nodes_;
  Grid grid_;
};

// The deviation of every point of a cloud. Shape: one a point. Units: mm. Frames: the cloud is in that of the
// surface. `threads`: 0 as many as the host has; the result does not depend on it. Cost: tests/bench.
std::vector<float> SignedDeviations(const PointCloud& cloud_in_model, const DeviationSurface& surface,
                                    double max_distance_mm, unsigned threads);

}  // namespace forgescan
