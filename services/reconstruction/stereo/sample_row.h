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
  std::uint8_t causes[2][kLanes];

  RawBlock Copy(const RawBlock& from, int length) {
    for (int i = 0; i < kLanes; ++i) {
      values[0][i] = i < length ? from.upper[i] : 0;
      values[1][i] = i < length ? from.lower[i] : 0;
      variances[i] = i < length ? from.variance[i] : std::uint16_t{0};
      causes[0][i] = i < length ? from.upper_cause[i] : 1;
      causes[1][i] = i < length ? from.lower_cause[i] : 1;
    }
    return {values[0], values[1], variances, causes[0], causes[1]};
  }
};

// What the line passes between: upper and lower raw values, their variance, and where both are valid.
struct RawPair {
  Floats upper, lower, variance;
  Mask valid;
};

FORGESCAN_INLINE RawPair PairAt(const RawBlock& raw) {
  return {Load(raw.upper), Load(raw.lower), LoadUpper(raw.variance),
          BothZero(raw.upper_cause, raw.lower_cause)};
}

FORGESCAN_INLINE RawPair Select(Mask mask, const RawPair& yes, const RawPair& no) {
  return {Select(mask, yes.upper, no.upper), Select(mask, yes.lower, no.lower),
          Select(mask, yes.variance, no.variance), (yes.valid & mask) | Without(no.valid, mask)};
}

// whole: raw rows below the block's first.
inline __attribute__((noinline)) RawPair PairOfMany(const RawView& view, const EpipolarBlock& block, int x,
                                                    Floats whole) {
  RawPair pair = {};
  pair.valid = FromBits(0);
  for (int i = 0; i < block.row_count; ++i) {
    RawEdge edge;
    const RawBlock raw = BlockAt(view, block.first_row + i, x);
    const bool is_edge = x + kLanes > view.width;
    pair = Select(Equal(whole, All(static_cast<float>(i))),
                  PairAt(is_edge ? edge.Copy(raw, view.width - x) : raw), pair);
  }
  return pair;
}

// Of at most two rows, which is nearly always enough.
FORGESCAN_INLINE RawPair PairOfTwo(const RawView& view, const EpipolarBlock& block, int x, Mask in_second) {
  const RawBlock first = BlockAt(view, block.first_row, x);
  const RawBlock second = BlockAt(view, block.first_row + block.row_count - 1, x);
  return Select(in_second, PairAt(second), PairAt(first));
}

FORGESCAN_INLINE void SampleBlock(const RawView& view, const EpipolarBlock& block, int x,
                                  const StereoRow& row) {
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
  const Mask valid = raw.valid & inside & LessEqual(Magnitude(step), All(view.max_step_px));
  Store(row.raw_px + x, Select(valid, view.sign * (raw.upper + part * step), All(__builtin_nanf(""))));
  // Two independent values of one variance.
  Store(row.variance_px2 + x, raw.variance * (1 - 2 * part * (1 - part)));
}

inline void SampleRow(const RawView& view, const EpipolarBlock* blocks, const StereoRow& row) {
  const std::ptrdiff_t blocks_a_row = (view.width + kLanes - 1) / kLanes;
  for (int x = 0; x < view.width; x += kLanes) {
    const EpipolarBlock& block = blocks[x / kLanes];
    __builtin_prefetch(&block + blocks_a_row, 0, 3);
    SampleBlock(view, block, x, row);
  }
}

}  // namespace
}  // namespace forgescan
