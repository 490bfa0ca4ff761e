// Points appended to a cloud whose memory was used before.
#pragma once

#include <cstddef>
#include <span>

#include "services/common/geometry/point_cloud.h"

namespace forgescan {

// What a row yields; all three have one length.
struct PointSpans {
  std::span<const Eigen::Vector3f> points;
  std::span<const Eigen::Vector3f> normals;
  std::span<const float> sigma_mm;
};

// Memory of three floats a point, three, and one.
struct PointTargets {
  float* points_mm = nullptr;
  float* normals = nullptr;
  float* sigma_mm = nullptr;
};

// Entries of the memory are overwritten where they stand: no page is cleared or touched anew.
class CloudWriter {
 public:
  // The first `used` points of the memory stay.
  explicit CloudWriter(PointCloud memory, std::size_t used = 0);

  // Past the cache: a full cloud is larger than it, and nobody reads it before it is whole.
  void Append(const PointSpans& row);
  // Where the next points are to be, room for so many; then tells how many there are.
  PointTargets Room(std::size_t count);
  void Added(std::size_t count) { size_ += count; }
  // Every step-th of the row from `first` on; few enough to stay in the cache.
  void AppendThinned(const PointSpans& row, std::size_t first, std::size_t step);
  PointCloud Finish() &&;

 private:
  void Fit(std::size_t size);
  std::size_t Grow(std::size_t count);  // where the new points begin

  PointCloud cloud_;
  std::size_t size_;
};

}  // namespace forgescan
