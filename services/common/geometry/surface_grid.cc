#include "services/common/geometry/surface_grid.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "services/common/geometry/surface_grid_builder.h"

namespace forgescan {
namespace {

using Arrays = SurfaceGridArrays;

constexpr float kLeastVoxel_mm = 1e-3F, kMostVoxel_mm = 1e6F;
constexpr std::uint32_t kMostBricks = 1U << 22;  // along an axis: 2^24 voxels, exact in single precision

Status CheckTriangle(std::uint32_t triangle, std::size_t triangles) {
  if (triangle < triangles) return {};
  return Fail(ErrorCode::kInvalidArgument, "the model's grid names triangle {} of {}", triangle, triangles);
}

Status CheckVoxel(const Arrays& arrays, std::uint32_t word, std::size_t triangles) {
  const std::uint32_t count = word & Arrays::kCountMask, value = word >> Arrays::kCountBits;
  if (count < 2 || count > Arrays::kMostListed) return CheckTriangle(value, triangles);
  if (value + std::size_t{count} <= arrays.lists.size()) return {};
  return Fail(ErrorCode::kInvalidArgument, "the model's grid leads to entry {} of a list of {}",
              value + count, arrays.lists.size());
}

}  // namespace

Status Check(const SurfaceGridArrays& arrays, std::size_t triangles) {
  const auto& bricks = arrays.bricks;
  const double cells = static_cast<double>(bricks[0]) * bricks[1] * bricks[2];
  const bool sized =
      arrays.low.allFinite() && arrays.voxel_mm >= kLeastVoxel_mm && arrays.voxel_mm <= kMostVoxel_mm &&
      arrays.band_mm >= 0 && std::isfinite(arrays.band_mm) &&
      *std::max_element(bricks.begin(), bricks.end()) <= kMostBricks && cells > 0 &&
      cells == static_cast<double>(arrays.tops.size()) && arrays.voxels.size() % Arrays::kVoxelsOfBrick == 0;
  if (!sized) {
    return Fail(ErrorCode::kInvalidArgument,
                "the model's grid of {} x {} x {} bricks with voxels of {} mm has {} of them", bricks[0],
                bricks[1], bricks[2], arrays.voxel_mm, arrays.tops.size());
  }
  for (const std::uint32_t word : arrays.tops) {
    if ((word & Arrays::kDetailed) == 0) {
      RETURN_IF_ERROR(CheckTriangle(word, triangles));
    } else if ((word & ~Arrays::kDetailed) >= arrays.voxels.size() / Arrays::kVoxelsOfBrick) {
      return Fail(ErrorCode::kInvalidArgument, "the model's grid leads to brick {} of {}",
                  word & ~Arrays::kDetailed, arrays.voxels.size() / Arrays::kVoxelsOfBrick);
    }
  }
  for (const std::uint32_t word : arrays.voxels) RETURN_IF_ERROR(CheckVoxel(arrays, word, triangles));
  for (const std::uint32_t triangle : arrays.lists) RETURN_IF_ERROR(CheckTriangle(triangle, triangles));
  return {};
}

Result<SurfaceGrid> SurfaceGrid::Build(const TriangleIndex& surface, const Eigen::Vector3f& low,
                                       const Eigen::Vector3f& high, const Size& size) {
  return BuildSurfaceGrid(surface, low, high, size);
}

// A place outside the box has the first triangle of the nearest place inside, and no list.
SurfaceGrid::Cell SurfaceGrid::CellAt(const Eigen::Vector3f& point) const {
  const float scale = 1 / arrays_.voxel_mm;
  std::array<std::uint32_t, 3> at;
  bool inside = true;
  for (int axis = 0; axis < 3; ++axis) {
    const std::uint32_t voxels = arrays_.bricks[static_cast<std::size_t>(axis)] * Arrays::kSide;
    const float place = (point[axis] - arrays_.low[axis]) * scale;
    inside = inside && place >= 0 && place < static_cast<float>(voxels);
    at[static_cast<std::size_t>(axis)] =
        static_cast<std::uint32_t>(std::clamp(place, 0.0F, static_cast<float>(voxels - 1)));
  }
  const std::size_t brick =
      (std::size_t{at[2] / Arrays::kSide} * arrays_.bricks[1] + at[1] / Arrays::kSide) * arrays_.bricks[0] +
      at[0] / Arrays::kSide;
  const std::uint32_t top = arrays_.tops[brick];
  if ((top & Arrays::kDetailed) == 0) return {0, top};
  const std::uint32_t within =
      ((at[2] % Arrays::kSide) * Arrays::kSide + at[1] % Arrays::kSide) * Arrays::kSide +
      at[0] % Arrays::kSide;
  const std::uint32_t word =
      arrays_.voxels[std::size_t{top & ~Arrays::kDetailed} * Arrays::kVoxelsOfBrick + within];
  const Cell cell{word & Arrays::kCountMask, word >> Arrays::kCountBits};
  return inside ? cell : Cell{0, Listed(cell).front()};
}

// The triangles of a cell that has a list; of any other, the single one stored there.
std::span<const std::uint32_t> SurfaceGrid::Listed(const Cell& cell) const {
  if (cell.count < 2 || cell.count > Arrays::kMostListed) return {&cell.value, 1};
  return arrays_.lists.subspan(cell.value, cell.count);
}

std::optional<TriangleIndex::Nearest> SurfaceGrid::Find(const TriangleIndex& surface,
                                                        const Eigen::Vector3f& point,
                                                        float max_distance_mm) const {
  if (!point.allFinite() || !(max_distance_mm >= 0)) return std::nullopt;
  const Cell cell = CellAt(point);
  if (cell.count == 0 && max_distance_mm <= arrays_.band_mm) return std::nullopt;
  if (cell.count == 0 || cell.count == Arrays::kCrowded)
    return surface.Find(point, max_distance_mm, cell.value);
  return surface.FindAmong(point, max_distance_mm, Listed(cell));
}

std::optional<TriangleIndex::Nearest> SurfaceGrid::FindRoughly(const TriangleIndex& surface,
                                                               const Eigen::Vector3f& point) const {
  if (!point.allFinite()) return std::nullopt;
  const Cell cell = CellAt(point);
  constexpr float kAnywhere = std::numeric_limits<float>::max();
  if (cell.count == Arrays::kCrowded) return surface.Find(point, kAnywhere, cell.value);
  return surface.FindAmong(point, kAnywhere, Listed(cell));
}

}  // namespace forgescan
