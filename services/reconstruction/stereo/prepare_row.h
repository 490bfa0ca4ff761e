// A sampled row made ready for the search. See kernel.h.
#pragma once

#include "services/reconstruction/stereo/kernel.h"
#include "services/reconstruction/stereo/lanes.h"

namespace forgescan {
namespace {

FORGESCAN_INLINE Mask IsStep(Floats step, SlopeLimits limits) {
  return LessEqual(All(limits.low), step) & LessEqual(step, All(limits.high));
}

FORGESCAN_INLINE unsigned PairBits(const float* at, SlopeLimits limits) {
  return Bits(IsStep(Load(at + 1) - Load(at), limits));
}

// Least squares by a parabola over five pixels of one surface (Savitzky and Golay, Anal. Chem. 36 (1964)
// 1627): no bias up to the third derivative, 17/35 of the variance. Where one of the five is missing the
// pixel stays as it is. A pixel that is off its parabola by more than the limit, and by more than 4 sigma,
// belongs to no surface.
// pairs: which neighbours of the block, the one before and the one behind are one surface.
FORGESCAN_INLINE void SmoothBlock(int x, const unsigned (&pairs)[3], float max_off_px, const StereoRow& row) {
  const float* const raw = row.raw_px + x;
  const Floats center = Load(raw), left = Load(raw - 1), right = Load(raw + 1);
  const Floats far_left = Load(raw - 2), far_right = Load(raw + 2);
  const Mask smooth = FromBits((pairs[1] << 2 | pairs[0] >> 14) & (pairs[1] << 1 | pairs[0] >> 15) &
                               pairs[1] & (pairs[1] >> 1 | pairs[2] << 15) & 0xffff);
  const Floats near_bend = (left - center) + (right - center);
  const Floats far_bend = (far_left - center) + (far_right - center);
  const Floats change = 12.0F / 35 * near_bend - 3.0F / 35 * far_bend;
  const Floats variance = Load(row.variance_px2 + x);
  const Floats square = change * change;
  const Mask off =
      smooth & Less(All(max_off_px * max_off_px), square) & Less(16 * 18.0F / 35 * variance, square);
  const Floats smoothed = Select(smooth, center + change, center);
  Store(row.coordinate_px + x, Select(off, All(__builtin_nanf("")), smoothed));
  Store(row.variance_px2 + x, Select(smooth, 17.0F / 35 * variance, variance));
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
  void AddBlock(int x, unsigned pairs, unsigned in_pair) {
    const Floats coordinate = Load(row_.coordinate_px + x);
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

inline void PrepareRow(int blocks, SlopeLimits limits, StereoRow& row) {
  unsigned pairs_of[3] = {0, 0, PairBits(row.raw_px, limits)};
  for (int x = 0; x < blocks * kLanes; x += kLanes) {
    pairs_of[0] = pairs_of[1];
    pairs_of[1] = pairs_of[2];
    pairs_of[2] = PairBits(row.raw_px + x + kLanes, limits);  // NaN behind the row: none
    SmoothBlock(x, pairs_of, limits.max_off_px, row);
  }
  Segmenter segmenter(row);
  unsigned before = 0;
  for (int block = 0; block < blocks; ++block) {
    const int x = block * kLanes;
    const Floats step = Load(row.coordinate_px + x + 1) - Load(row.coordinate_px + x);
    const Mask is_pair = IsStep(step, limits);
    Store(row.inverse_step + x, Select(is_pair, 1 / step, All(__builtin_nanf(""))));
    const Floats variance = Load(row.variance_px2 + x), next_variance = Load(row.variance_px2 + x + 1);
    Store(row.pair_variance_px2 + x, Select(Less(variance, next_variance), next_variance, variance));
    const unsigned pairs = Bits(is_pair);
    row.pair_bits[block] = static_cast<std::uint16_t>(pairs);
    segmenter.AddBlock(x, pairs, (pairs | pairs << 1 | before) & 0xffff);
    before = pairs >> 15;
  }
  segmenter.Finish(blocks * kLanes);
  row.segment_count = segmenter.is_full() ? kMaxSegments + 1 : row.segment_count;
}

}  // namespace
}  // namespace forgescan
