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
  const std::uint8_t *upper_cause, *lower_cause;
};

// The variance is that of the even row, see DecodedView.
FORGESCAN_INLINE RawBlock BlockAt(const RawView& view, int row, int column) {
  const float* const coordinate = view.coordinate_px + row * view.coordinate_stride + column;
  const std::uint8_t* const cause = view.cause + row * view.cause_stride + column;
  return {coordinate, coordinate + view.coordinate_stride,
          view.variance_px2 + (row + 1) / 2 * view.variance_stride + column, cause, cause + view.cause_stride};
}

// Asks for what the lines a few rows below will read first around this block. Memory hands out pieces of many
// rows slowly, so the loops that compute ask, and sampling finds all of it in the cache.
FORGESCAN_INLINE void FetchAhead(const FetchTask& task, int block) {
  constexpr int kRowsAhead = 3;
  const EpipolarBlock& line = task.line[block];
  if (line.row_count > 0) {
    const int row = line.first_row + line.row_count + kRowsAhead;
    const int later = row < task.view->height ? row : task.view->height - 1;
    const RawBlock raw = BlockAt(*task.view, later, block * kLanes);
    __builtin_prefetch(raw.upper, 0, 3);
    const void* const at_times = raw.upper;  // of odd rows no variance is read; without a branch
    __builtin_prefetch((later & 1) == 0 ? raw.variance : at_times, 0, 3);
    __builtin_prefetch(raw.upper_cause, 0, 3);
  }
}

}  // namespace
}  // namespace forgescan
