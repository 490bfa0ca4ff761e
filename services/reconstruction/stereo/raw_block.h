// Blocks of the raw images. See kernel.h.
#pragma once

#include "services/reconstruction/stereo/kernel.h"
#include "services/reconstruction/stereo/lanes.h"

namespace forgescan {
namespace {

// Two neighbouring raw rows at 16 columns.
struct RawBlock {
  const float *upper, *lower;
  const std::uint16_t* variance;
};

// The variance is that of the even row, see DecodedView.
FORGESCAN_INLINE RawBlock BlockAt(const RawView& view, int row, int column) {
  const float* const coordinate = view.coordinate_px + row * view.coordinate_stride + column;
  return {coordinate, coordinate + view.coordinate_stride,
          view.variance_px2 + (row + 1) / 2 * view.variance_stride + column};
}

// Asks for what the lines a few rows below will read first around this block. Memory hands out pieces of many
// rows slowly, so the loops that compute ask, and sampling finds all of it in the cache.
FORGESCAN_INLINE void FetchAhead(const FetchTask& task, int block) {
  constexpr int kRowsAhead = 3;
  const EpipolarBlock& line = task.line[block];
  if (line.row_count > 0) {
    const int row = line.first_row + line.row_count + kRowsAhead;
    const RawBlock raw = BlockAt(*task.view, row < task.view->height - 1 ? row : 0, block * kLanes);
    __builtin_prefetch(raw.upper, 0, 2);
    __builtin_prefetch(raw.variance, 0, 2);
  }
}

}  // namespace
}  // namespace forgescan
