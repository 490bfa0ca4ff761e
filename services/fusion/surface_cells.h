// A view's cloud as spots of surface: the mean of the points in each cell of viewing directions. Cells in
// space would cut a surface that lies along their border, and a mean of half its noise does not move with it.
#pragma once

#include <Eigen/Geometry>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "services/common/geometry/point_cloud.h"

namespace forgescan {

// Frame: camera, mm.
struct SurfaceCell {
  std::uint64_t key;  // of the direction: two clouds of one view meet where their keys are equal
  Eigen::Vector3d point, normal;
  double variance_mm2;  // of the point along its normal, as the cloud predicts it
};

struct SurfaceCellOptions {
  double cell_rad = 0.003;      // 2 mm at 650 mm: small against the curvature of what is seen
  std::size_t min_points = 4;   // fewer do not make a cell
  double min_coherence = 0.99;  // length of the mean normal: less, and an edge runs through the cell
  double max_spread_mm = 0.1;   // rms along the mean normal: more, and it is two surfaces
};

// A size of cells that hold nine points on average, where every nth pixel of a camera becomes one.
double CellRadOf(double focal_px, int every_nth_point);

// Of the cell that a point's direction lies in. Nothing for a point that is not in front of the camera, or is
// no number.
std::optional<std::uint64_t> DirectionKey(const Eigen::Vector3d& p_in_camera, double cell_rad);

// Ascending keys; cells with few points or more than one surface are left out, and points without a
// direction. The cloud needs normals and sigma_mm. Cost: a sort by digits and two passes over the points,
// measured in tests/bench/standing_bench.cc.
std::vector<SurfaceCell> SurfaceCells(const PointCloud& cloud_in_camera, const SurfaceCellOptions& options);

}  // namespace forgescan
