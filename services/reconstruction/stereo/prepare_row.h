// A sampled row made ready for the search. See kernel.h.
#pragma once

#include "services/reconstruction/stereo/kernel.h"
#include "services/reconstruction/stereo/lanes.h"

namespace forgescan {
namespace {

// Whether two neighbours that differ by this are one surface.
FORGESCAN_INLINE Mask IsStep(Floats step, const SlopeLimits& limits) {
  return IsWithin(step, limits.low, limits.high);
}

// The block before, this one and the one behind it, of the raw coordinates.
struct RawBlocks {
  Floats before, here, behind;
};

struct Smoothed {
  Floats coordinate, variance;
};

// A bit for each pixel: whether its two right neighbours are one surface.
FORGESCAN_INLINE unsigned RightSteps(const RawBlocks& raw, const SlopeLimits& limits) {
  return Bits(IsStep(Shifted<2>(raw.here, raw.behind) - Shifted<1>(raw.here, raw.behind), limits));
}

// Least squares by a parabola over five pixels of one surface (Savitzky and Golay, Anal. Chem. 36 (1964)
// 1627): no bias up to the third derivative, 17/35 of the variance. Where one of the five is missing the
// pixel stays as it is. A pixel that is off its parabola by more than the limit, and by more than 4 sigma,
// belongs to no surface.
// steps: of this block in its upper half and of the one before, as by RightSteps.
FORGESCAN_INLINE Smoothed SmoothBlock(int x, const RawBlocks& raw, unsigned steps, const SlopeLimits& limits,
                                      const StereoRow& row) {
  const Floats center = raw.here;
  const Floats left = Shifted<kLanes - 1>(raw.before, raw.here), right = Shifted<1>(raw.here, raw.behind);
  const Floats far_left = Shifted<kLanes - 2>(raw.before, raw.here);
  const Floats far_right = Shifted<2>(raw.here, raw.behind);
  const Mask smooth = FromBits((steps >> 16) & (steps >> 15) & (steps >> 14) & (steps >> 13));
  const Floats near_bend = (left - center) + (right - center);
  const Floats far_bend = (far_left - center) + (far_right - center);
  const Floats change = 12.0F / 35 * near_bend - 3.0F / 35 * far_bend;
  const Floats variance = Load(row.variance_px2 + x);
  const Floats square = change * change;
  const Mask off = smooth & Less(All(limits.max_off_px * limits.max_off_px), square) &
                   Less(16 * 18.0F / 35 * variance, square);
  const Floats coordinate = Select(off, All(__builtin_nanf("")), Select(smooth, center + change, center));
  Store(row.coordinate_px + x, coordinate);
  return {coordinate, Select(smooth, 17.0F / 35 * variance, variance)};
}

// Splits a row into segments of ascending coordinates while it is read from left to right.
class Segmenter {
 public:
  explicit Segmenter(StereoRow& row) : row_(row) {
    row_.segment_count = 0;
    Begin(0);
  }

  // pairs: of the block; in_pair: the lanes that belong to a pair with either neighbour. Others are no part
  // of any surface.
  void AddBlock(int x, Floats coordinate, unsigned pairs, unsigned in_pair) {
    float* const ranks = row_.ranks + x + shift_;
    if (in_pair == 0) {
      Store(ranks, All(last_));
    } else if ((pairs & 0x7fff) == 0x7fff && row_.coordinate_px[x] > last_) {
      Note(row_.coordinate_px[x]);
      Store(ranks, coordinate);
      last_ = row_.coordinate_px[x + kLanes - 1];
    } else {
      for (int i = 0; i < kLanes; ++i) {
        AddPixel(x + i, (in_pair >> i & 1) != 0);
      }
    }
  }

  bool is_full() const { return is_full_; }

  void Finish(int end) {
    End(end);
    row_.segment_count += 1;
  }

 private:
  static constexpr float kInfinity = __builtin_inff();

  void AddPixel(int x, bool in_pair) {
    const float coordinate = row_.coordinate_px[x];
    if (in_pair && coordinate <= last_) {
      End(x);
      if (row_.segment_count < kMaxSegments - 1) {
        row_.segment_count += 1;
        Begin(x);
      } else {
        is_full_ = true;
      }
    }
    if (in_pair) {
      Note(coordinate);
      last_ = coordinate;
    }
    row_.ranks[x + shift_] = last_;
  }
  void Note(float coordinate) {
    RowSegment& segment = row_.segments[row_.segment_count];
    segment.low = segment.low == kInfinity ? coordinate : segment.low;
  }
  void Begin(int x) {
    shift_ = row_.segment_count * kSegmentMargin;
    row_.segments[row_.segment_count] = {
        .begin = x, .end = x, .ranks = x + shift_, .low = kInfinity, .high = -kInfinity};
    last_ = -kInfinity;
  }
  void End(int x) {
    RowSegment& segment = row_.segments[row_.segment_count];
    segment.end = x;
    segment.high = last_;
    for (int i = 0; i < kSegmentMargin; ++i) {
      row_.ranks[x + shift_ + i] = kInfinity;
    }
  }

  StereoRow& row_;
  float last_ = 0;
  int shift_ = 0;
  bool is_full_ = false;
};

inline void PrepareRow(int blocks, const SlopeLimits& limits, StereoRow& row) {
  const Floats none = All(__builtin_nanf(""));
  RawBlocks raw = {none, none, Load(row.raw_px)};
  Smoothed here = {none, none};
  Segmenter segmenter(row);
  unsigned before = 0;
  unsigned steps = RightSteps(raw, limits) << 16;
  for (int x = 0; x <= blocks * kLanes; x += kLanes) {
    raw = {raw.here, raw.behind, Load(row.raw_px + x + kLanes)};  // NaN behind the row
    steps = steps >> 16 | RightSteps(raw, limits) << 16;
    const Smoothed next =
        x < blocks * kLanes ? SmoothBlock(x, raw, steps, limits, row) : Smoothed{none, none};
    if (x > 0) {
      const Floats step = Shifted<1>(here.coordinate, next.coordinate) - here.coordinate;
      const unsigned pairs = Bits(IsStep(step, limits)), in_pair = (pairs | pairs << 1 | before) & 0xffff;
      Store(row.variance_px2 + x - kLanes, Select(FromBits(in_pair), here.variance, none));
      segmenter.AddBlock(x - kLanes, here.coordinate, pairs, in_pair);
      before = pairs >> 15;
    }
    here = next;
  }
  segmenter.Finish(blocks * kLanes);
  row.segment_count = segmenter.is_full() ? kMaxSegments + 1 : row.segment_count;
}

}  // namespace
}  // namespace forgescan
