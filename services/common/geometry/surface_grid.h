// Which triangles can be nearest, for every place about a part: computed once per model, so that a search at
// run time is a look-up and a few exact distances.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>

#include "services/common/geometry/triangle_index.h"
#include "services/common/result.h"

namespace forgescan {

// As it stands in a model bundle. Units: mm. Frames: that of the vertices.
// The box from `low` is cut into bricks of 4 x 4 x 4 voxels, x fastest. A brick's word is kDetailed | number
// of its 64 voxels in `voxels`, or the triangle nearest to its centre when no surface lies within band_mm of
// it. A voxel's word is a value (28 bits) and a count (4 bits): 1 = the value is the only triangle that can
// be nearest; 2 to kMostListed = so many triangles of `lists` from the value on (voxels share lists); 0 = no
// surface within band_mm, the value is the triangle nearest to the centre; kCrowded = more triangles than
// that could be nearest, the value is the one nearest to the centre.
struct SurfaceGridArrays {
  static constexpr std::uint32_t kDetailed = 0x80000000U;
  static constexpr std::uint32_t kCountBits = 4, kCountMask = 15, kMostListed = 14, kCrowded = 15;
  static constexpr std::uint32_t kSide = 4, kVoxelsOfBrick = kSide * kSide * kSide;

  Eigen::Vector3f low = Eigen::Vector3f::Zero();
  float voxel_mm = 0;
  float band_mm = 0;
  std::array<std::uint32_t, 3> bricks = {0, 0, 0};  // along each axis
  std::span<const std::uint32_t> tops, voxels, lists;
};

// Read-only and cheap to copy: copies share the memory, which may be a mapped file. Any number of threads may
// ask at the same time.
class SurfaceGrid {
 public:
  static constexpr float kBand_mm = 4;  // within it a search tests the listed triangles only

  SurfaceGrid() = default;
  // `memory` owns what the arrays point to. Nothing is checked, see Check().
  SurfaceGrid(const SurfaceGridArrays& arrays, std::shared_ptr<const void> memory)
      : arrays_(arrays), memory_(std::move(memory)) {}

  // The grid of the triangles of `surface`, reaching margin_mm beyond their box [low, high]. The voxels are
  // voxel_mm wide, or twice, four times, ... that, as long as it takes to stay within 64 MB. Equal input
  // gives equal bytes for any number of threads. Errors: kInvalidArgument for voxel_mm or margin_mm not
  // positive, and for 2^27 triangles or more.
  struct Size {
    float voxel_mm;
    float margin_mm;
  };
  static Result<SurfaceGrid> Build(const TriangleIndex& surface, const Eigen::Vector3f& low,
                                   const Eigen::Vector3f& high, const Size& size);

  // As TriangleIndex::Find of the surface the grid was built from: the same distance, the same triangle but
  // for ties.
  std::optional<TriangleIndex::Nearest> Find(const TriangleIndex& surface, const Eigen::Vector3f& point,
                                             float max_distance_mm) const;

  // However far: exact within band_mm; beyond, the nearest place of the triangle stored there, whose distance
  // is too long by less than the diagonal of a brick for a point inside the box, and by more outside. Nothing
  // only for a point that is not finite.
  std::optional<TriangleIndex::Nearest> FindRoughly(const TriangleIndex& surface,
                                                    const Eigen::Vector3f& point) const;

  const SurfaceGridArrays& arrays() const { return arrays_; }
  bool empty() const { return arrays_.tops.empty(); }

 private:
  struct Cell {
    std::uint32_t count;  // as in a voxel's word; 0 also for a brick that is not detailed
    std::uint32_t value;
  };
  Cell CellAt(const Eigen::Vector3f& point) const;
  std::span<const std::uint32_t> Listed(const Cell& cell) const;

  SurfaceGridArrays arrays_;
  std::shared_ptr<const void> memory_;
};

// Errors: kInvalidArgument naming what does not fit: sizes, or a word that leads out of the arrays or names a
// triangle beyond `triangles`.
Status Check(const SurfaceGridArrays& arrays, std::size_t triangles);

}  // namespace forgescan
