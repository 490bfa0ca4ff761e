// Coordinates along an epipolar line through a raw image. See kernel.h.
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

// The last columns of an image whose width is no multiple of 16, where a whole block must not be read.
struct RawEdge {
  float values[2][kLanes];
  std::uint16_t variances[kLanes];
  std::uint8_t causes[2][kLanes];

  RawBlock Copy(const RawBlock& from, int length) {
    for (int i = 0; i < kLanes; ++i) {
      values[0][i] = i < length ? from.upper[i] : 0;
      values[1][i] = i < length ? from.lower[i] : 0;
      variances[i] = i < length ? from.variance[i] : 0;
      causes[0][i] = i < length ? from.upper_cause[i] : 1;
      causes[1][i] = i < length ? from.lower_cause[i] : 1;
    }
    return {values[0], values[1], variances, causes[0], causes[1]};
  }
};

FORGESCAN_INLINE RawBlock BlockAt(const RawView& view, int row, int column) {
  const float* const coordinate = view.coordinate_px + row * view.coordinate_stride + column;
  const std::uint8_t* const cause = view.cause + row * view.cause_stride + column;
  return {coordinate, coordinate + view.coordinate_stride,
          view.variance_px2 + row * view.variance_stride + column, cause, cause + view.cause_stride};
}

// Asks for what the lines a few rows below will read here first: memory hands out pieces of many rows too
// slowly by itself.
FORGESCAN_INLINE void FetchAhead(const RawView& view, int row, int column) {
  constexpr int kRowsAhead = 6;
  const int later = row + kRowsAhead < view.height ? row + kRowsAhead : view.height - 1;
  const RawBlock block = BlockAt(view, later, column);
  __builtin_prefetch(block.upper, 0, 2);
  __builtin_prefetch(block.variance, 0, 2);
  __builtin_prefetch(block.upper_cause, 0, 2);
}

struct Sampled {
  Floats coordinate_px, variance_px2;
};

// Adds the lanes whose line runs between these two rows.
FORGESCAN_INLINE void AddRow(const RawBlock& raw, Mask here, Floats part, const RawView& view,
                             Sampled& sampled) {
  const Floats upper = Load(raw.upper);
  const Floats step = Load(raw.lower) - upper;
  const Mask inside = here & LessEqual(Floats{}, part);  // a line above the image truncates to its first row
  const Mask valid =
      inside & BothZero(raw.upper_cause, raw.lower_cause) & LessEqual(Magnitude(step), All(view.max_step_px));
  // Two independent values of one variance: fringes run across the rows, so both rows have nearly the same.
  const Floats variance = LoadUpper(raw.variance) * (1 - 2 * part * (1 - part));
  sampled.coordinate_px = Select(valid, view.sign * (upper + part * step), sampled.coordinate_px);
  sampled.variance_px2 = Select(valid, variance, sampled.variance_px2);
}

inline void SampleRow(const RawView& view, const EpipolarBlock* blocks, const StereoRow& row) {
  const Floats lane = LaneNumbers();
  for (int x = 0; x < view.width; x += kLanes) {
    const EpipolarBlock& block = blocks[x / kLanes];
    const Floats line = block.row[0] + lane * (block.row[1] + lane * block.row[2]);
    Store(row.column_px + x, block.column[0] + lane * (block.column[1] + lane * block.column[2]));
    const Floats whole = Truncated(line);
    Sampled sampled = {All(__builtin_nanf("")), Floats{}};
    __builtin_prefetch(&block + (view.width + kLanes - 1) / kLanes, 0, 3);
    if (block.row_count > 0) {
      FetchAhead(view, block.first_row + block.row_count, x);
    }
    for (int y = block.first_row; y < block.first_row + block.row_count; ++y) {
      RawBlock raw = BlockAt(view, y, x);
      RawEdge edge;
      if (x + kLanes > view.width) {
        raw = edge.Copy(raw, view.width - x);
      }
      AddRow(raw, Equal(whole, All(static_cast<float>(y))), line - whole, view, sampled);
    }
    Store(row.raw_px + x, sampled.coordinate_px);
    Store(row.variance_px2 + x, sampled.variance_px2);
  }
}

}  // namespace
}  // namespace forgescan
