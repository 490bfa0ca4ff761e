// Memory for the rows of the stereo kernels.
#pragma once

#include <cstddef>
#include <limits>
#include <vector>

#include "services/reconstruction/stereo/kernel.h"

namespace forgescan {

// Arrays of one row each, with NaN margins.
class RowArrays {
 public:
  RowArrays(int count, int length)
      : stride_(static_cast<std::size_t>(length + 2 * kRowMargin)),
        values_(static_cast<std::size_t>(count) * stride_, std::numeric_limits<float>::quiet_NaN()) {}
  float* operator[](int i) { return &values_[static_cast<std::size_t>(i) * stride_ + kRowMargin]; }

 private:
  std::size_t stride_;
  std::vector<float> values_;
};

// A StereoRow whose kept arrays are given.
class PreparedRow {
 public:
  PreparedRow(int blocks, float* coordinate_px, float* variance_px2, float* column_px)
      : arrays_(1, blocks * kStereoLanes),
        ranks_(static_cast<std::size_t>(blocks * kStereoLanes + (kMaxSegments + 1) * kSegmentMargin)),
        segments_(kMaxSegments) {
    row_ = {.raw_px = arrays_[0],
            .coordinate_px = coordinate_px,
            .variance_px2 = variance_px2,
            .column_px = column_px,
            .ranks = ranks_.data(),
            .segments = segments_.data(),
            .segment_count = 0};
  }
  StereoRow& row() { return row_; }

 private:
  RowArrays arrays_;
  std::vector<float> ranks_;
  std::vector<RowSegment> segments_;
  StereoRow row_;
};

}  // namespace forgescan
