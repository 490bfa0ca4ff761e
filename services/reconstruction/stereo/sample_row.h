// Coordinates along an epipolar line through a raw image. See kernel.h.
#pragma once

#include "services/reconstruction/stereo/kernel.h"
#include "services/reconstruction/stereo/lanes.h"
#include "services/reconstruction/stereo/raw_block.h"

namespace forgescan {
namespace {

// The last columns of an image whose width is no multiple of 16, where a whole block must not be read.
struct RawEdge {
  float values[2][kLanes];
  std::uint16_t variances[kLanes];

  RawBlock Copy(const RawBlock& from, int length) {
    for (int i = 0; i < kLanes; ++i) {
      values[0][i] = i < length ? from.upper[i] : __builtin_nanf("");
      values[1][i] = i < length ? from.lower[i] : __builtin_nanf("");
      variances[i] = i < length ? from.variance[i] : std::uint16_t{0};
    }
    return {values[0], values[1], variances};
  }
};

// What the line passes between: upper and lower raw values, NaN where masked, and their variance.
struct RawPair {
  Floats upper, lower, variance;
};

// yes in the lanes of the mask, no in the others.
FORGESCAN_INLINE RawPair PairAt(Mask mask, const RawBlock& yes, const RawBlock& no) {
  return {Select(mask, Load(yes.upper), Load(no.upper)), Select(mask, Load(yes.lower), Load(no.lower)),
          SelectUpper(mask, yes.variance, no.variance)};
}

// whole: raw rows below the block's first.
inline __attribute__((noinline)) RawPair PairOfMany(const RawView& view, const EpipolarBlock& block, int x,
                                                    Floats whole) {
  RawPair pair = {All(__builtin_nanf("")), All(__builtin_nanf("")), Floats{}};
  for (int i = 0; i < block.row_count; ++i) {
    RawEdge edge;
    RawBlock raw = BlockAt(view, block.first_row + i, x);
    if (x + kLanes > view.width) {
      raw = edge.Copy(raw, view.width - x);
    }
    const Mask here = Equal(whole, All(static_cast<float>(i)));
    const RawPair one = PairAt(here, raw, raw);
    pair = {Select(here, one.upper, pair.upper), Select(here, one.lower, pair.lower),
            Select(here, one.variance, pair.variance)};
  }
  return pair;
}

// Of at most two rows, which is nearly always enough.
FORGESCAN_INLINE RawPair PairOfTwo(const RawView& view, const EpipolarBlock& block, int x, Mask in_second) {
  return PairAt(in_second, BlockAt(view, block.first_row + block.row_count - 1, x),
                BlockAt(view, block.first_row, x));
}

// Where a row's samples go.
struct Sampled {
  float *raw_px, *variance_px2, *column_px;
};

FORGESCAN_INLINE void SampleBlock(const RawView& view, const EpipolarBlock& block, int x,
                                  const Sampled& row) {
  const Floats lane = LaneNumbers();
  Store(row.column_px + x, block.column[0] + lane * (block.column[1] + lane * block.column[2]));
  if (block.row_count == 0) {
    Store(row.raw_px + x, All(__builtin_nanf("")));
    return;
  }
  const Floats line = block.row[0] + lane * (block.row[1] + lane * block.row[2]);
  const Mask inside = LessEqual(Floats{}, line) & Less(line, All(static_cast<float>(block.row_count)));
  Floats whole;
  RawPair raw;
  if (block.row_count <= 2 && x + kLanes <= view.width) {
    const Mask in_second = LessEqual(All(1), line);
    whole = Select(in_second, All(1), Floats{});
    raw = PairOfTwo(view, block, x, in_second);
  } else {
    whole = Truncated(line);
    raw = PairOfMany(view, block, x, whole);
  }
  const Floats part = line - whole;
  const Floats step = raw.lower - raw.upper;
  const Mask valid = inside & LessEqual(Magnitude(step), All(view.max_step_px));
  Store(row.raw_px + x, Select(valid, view.sign * (raw.upper + part * step), All(__builtin_nanf(""))));
  // Two independent values of one variance.
  Store(row.variance_px2 + x, raw.variance * (1 - 2 * part * (1 - part)));
}

inline void SampleRow(const RawView& view, const EpipolarBlock* blocks, const StereoRow& row) {
  const std::ptrdiff_t blocks_a_row = (view.width + kLanes - 1) / kLanes;
  const RawView raw = view;  // of its own, so that no store can change it
  const Sampled sampled = {row.raw_px, row.variance_px2, row.column_px};
  for (int x = 0; x < raw.width; x += kLanes) {
    __builtin_prefetch(blocks + blocks_a_row, 0, 3);
    SampleBlock(raw, *blocks++, x, sampled);
  }
}

}  // namespace
}  // namespace forgescan
