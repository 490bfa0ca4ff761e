// Partners of a row's pixels in the other camera's row. See kernel.h.
#pragma once

#include "services/reconstruction/stereo/kernel.h"
#include "services/reconstruction/stereo/lanes.h"

namespace forgescan {
namespace {

struct Match {
  Mask found;
  Floats part;          // of the way between two pixels
  Floats inverse_step;  // there
  Floats column_px, column_step_px, variance_px2;
};

// The last of the ranks that is not above any of the wanted coordinates, or the first one.
inline int StartOf(const float* ranks, int length, Floats wanted, Mask valid) {
  float least = __builtin_inff();
  const unsigned bits = Bits(valid);
  for (int i = 0; i < kLanes; ++i) {
    const float value = wanted[i];
    least = (bits >> i & 1) != 0 && value < least ? value : least;
  }
  int low = 0, high = length;  // the answer is in [low, high)
  while (high - low > 1) {
    const int middle = (low + high) / 2;
    (ranks[middle] <= least ? low : high) = middle;
  }
  return low;
}

// How many ranks from `ranks` on are not above each coordinate.
FORGESCAN_INLINE Ints CountRanks(const float* ranks, Floats wanted, Mask valid) {
  constexpr int kUsual = 22;  // 16 pixels of equal scale, what the hint allows for, and some more
  Ints count = {};
#pragma GCC unroll 22
  for (int i = 0; i < kUsual; ++i) {
    count = CountUp(count, LessEqual(All(ranks[i]), wanted));
  }
  for (int i = kUsual; Any(valid & LessEqual(All(ranks[i]), wanted)); ++i) {
    count = CountUp(count, LessEqual(All(ranks[i]), wanted));
  }
  return count;
}

// hint: where to begin; only time depends on it. Left at what suits the same columns of the next row.
FORGESCAN_INLINE Match FindInSegment(Floats wanted, Mask valid, const StereoRow& into,
                                     const RowSegment& segment, int& hint) {
  constexpr int kBack = 2;  // ranks a hint is set back by
  const float* const all_ranks = into.ranks + segment.ranks;
  const int length = segment.end - segment.begin;
  int start = hint < 0 ? 0 : (hint < length ? hint : length - 1);
  const bool too_far = Any(valid & Less(wanted, All(all_ranks[start])));
  if (too_far || !Any(valid & Less(wanted, All(all_ranks[start + kLanes])))) {
    start = StartOf(all_ranks, length, wanted, valid);
  }
  const Ints count = CountRanks(all_ranks + start, wanted, valid);
  const Mask in_reach = valid & Above(count, 0);
  const Ints index = count - 1;
  hint = start + index[__builtin_ctz(Bits(valid))] - kBack;
  const int x = segment.begin + start;
  Floats coordinate, inverse_step, column, next_column, variance;
  if (!Any(in_reach & Above(index, 2 * kLanes - 1))) {
    coordinate = LookUpNear(into.coordinate_px + x, index);
    inverse_step = LookUpNear(into.inverse_step + x, index);
    column = LookUpNear(into.column_px + x, index);
    next_column = LookUpNear(into.column_px + x + 1, index);
    variance = LookUpNear(into.pair_variance_px2 + x, index);
  } else {
    coordinate = LookUp(into.coordinate_px + x, index);
    inverse_step = LookUp(into.inverse_step + x, index);
    column = LookUp(into.column_px + x, index);
    next_column = LookUp(into.column_px + x + 1, index);
    variance = LookUp(into.pair_variance_px2 + x, index);
  }
  return {.found = in_reach & IsNumber(inverse_step),
          .part = (wanted - coordinate) * inverse_step,
          .inverse_step = inverse_step,
          .column_px = column,
          .column_step_px = next_column - column,
          .variance_px2 = variance};
}

struct BlockRange {
  float low, high;
};

inline BlockRange RangeOf(Floats values, Mask valid) {
  BlockRange range = {__builtin_inff(), -__builtin_inff()};
  const unsigned bits = Bits(valid);
  for (int i = 0; i < kLanes; ++i) {
    if ((bits >> i & 1) != 0) {
      range.low = values[i] < range.low ? values[i] : range.low;
      range.high = values[i] > range.high ? values[i] : range.high;
    }
  }
  return range;
}

struct Search {
  Match first;  // the places found first
  Mask twice;   // coordinates found in more than one place
};

// A row with folds, or with something thin before it: every segment that has such coordinates.
inline __attribute__((noinline)) Search FindInSegments(Floats wanted, Mask valid, const StereoRow& into) {
  const BlockRange range = RangeOf(wanted, valid);
  Search search = {};
  search.first.found = FromBits(0);
  search.twice = FromBits(0);
  for (int i = 0; i < into.segment_count; ++i) {
    const RowSegment& segment = into.segments[i];
    if (segment.low > range.high || segment.high < range.low) {
      continue;
    }
    int hint = 0;
    const Match match = FindInSegment(wanted, valid, into, segment, hint);
    search.twice = search.twice | (search.first.found & match.found);
    const Mask fresh = Without(match.found, search.first.found);
    search.first.part = Select(fresh, match.part, search.first.part);
    search.first.inverse_step = Select(fresh, match.inverse_step, search.first.inverse_step);
    search.first.column_px = Select(fresh, match.column_px, search.first.column_px);
    search.first.column_step_px = Select(fresh, match.column_step_px, search.first.column_step_px);
    search.first.variance_px2 = Select(fresh, match.variance_px2, search.first.variance_px2);
    search.first.found = search.first.found | match.found;
  }
  return search;
}

FORGESCAN_INLINE Search Find(Floats wanted, Mask valid, const StereoRow& left, const StereoRow& right,
                             int& hint) {
  Search search = {};
  if (right.segment_count == 1) {
    search.first = FindInSegment(wanted, valid, right, right.segments[0], hint);
    search.twice = FromBits(0);
  } else if (right.segment_count <= kMaxSegments) {
    search = FindInSegments(wanted, valid, right);
  } else {
    search.first.found = search.twice = valid;
  }
  if (left.segment_count > 1) {
    const bool too_many = left.segment_count > kMaxSegments;
    const Mask again = too_many ? valid : FindInSegments(wanted, valid, left).twice;
    search.twice = search.twice | (search.first.found & again);
  }
  return search;
}

// Whether going there and back closes, the left row taken as straight on either side of the pixel: with a and
// b the coordinates between the pixel and its two right neighbours, back - here = a b / (a + b) (1 /
// right_step - 1 / left_step).
FORGESCAN_INLINE Mask Closes(int x, const StereoRow& left, const Match& match, float max_left_right_px) {
  const int block = x / kLanes;
  const unsigned pairs = left.pair_bits[block];
  const unsigned before = x == 0 ? 0 : left.pair_bits[block - 1] >> 15 & 1U;
  const Mask on_one_surface = FromBits(pairs & (pairs << 1 | before));
  const Floats center = Load(left.coordinate_px + x);
  const Floats left_step = center - Load(left.coordinate_px + x - 1);
  const Floats right_step = Load(left.coordinate_px + x + 1) - center;
  const Floats gap = match.part * (1 - match.part) * Magnitude(left_step - right_step);
  return on_one_surface & LessEqual(gap, max_left_right_px * left_step * right_step * match.inverse_step);
}

FORGESCAN_INLINE MatchCounts MatchBlock(int x, const StereoRow& left, const StereoRow& right,
                                        float max_left_right_px, int& hint, const DisparityRow& disparity) {
  const Floats wanted = Load(left.coordinate_px + x);
  const Mask valid = IsNumber(wanted);
  const Floats none = All(__builtin_nanf(""));
  if (!Any(valid)) {
    Store(disparity.disparity_px + x, none);
    return {};
  }
  // Between two right pixels that share three fifths of their noise (five-point parabolas of neighbours).
  constexpr float kUnshared = 2 * (1 - 336.0F / 595);
  const Search search = Find(wanted, valid, left, right, hint);
  const Match& match = search.first;
  const Mask once = Without(match.found, search.twice);
  const Mask good = once & Closes(x, left, match, max_left_right_px);
  const Floats partner = match.column_px + match.part * match.column_step_px;
  const Floats px_per_coordinate = match.column_step_px * match.inverse_step;
  const Floats right_variance = match.variance_px2 * (1 - kUnshared * match.part * (1 - match.part));
  const Floats variance =
      px_per_coordinate * px_per_coordinate * (Load(left.variance_px2 + x) + right_variance);
  Store(disparity.disparity_px + x, Select(good, Load(left.column_px + x) - partner, none));
  Store(disparity.variance_px2 + x, variance);
  return {.candidates = Count(valid),
          .no_partner = Count(Without(valid, match.found)),
          .ambiguous = Count(match.found & search.twice),
          .left_right = Count(Without(once, good))};
}

inline MatchCounts MatchRow(int blocks, const StereoRow& left, const StereoRow& right,
                            float max_left_right_px, int* hints, const DisparityRow& disparity) {
  MatchCounts sum;
  for (int block = 0; block < blocks; ++block) {
    const MatchCounts counts =
        MatchBlock(block * kLanes, left, right, max_left_right_px, hints[block], disparity);
    sum.candidates += counts.candidates;
    sum.no_partner += counts.no_partner;
    sum.ambiguous += counts.ambiguous;
    sum.left_right += counts.left_right;
  }
  return sum;
}

}  // namespace
}  // namespace forgescan
