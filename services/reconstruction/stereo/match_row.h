// Partners of a row's pixels in the other camera's row. See kernel.h.
#pragma once

#include "services/reconstruction/stereo/kernel.h"
#include "services/reconstruction/stereo/lanes.h"
#include "services/reconstruction/stereo/prepare_row.h"
#include "services/reconstruction/stereo/raw_block.h"

namespace forgescan {
namespace {

struct Match {
  Mask found;
  Floats part;          // of the way between two pixels
  Floats inverse_step;  // there
  Floats column_px, column_step_px, variance_px2;
};

// Where the coordinates of a block are among the ranks of a segment: the last ones that are not above them
// are at begin + index.
struct Place {
  int begin;
  Ints index;
};

// A place that nothing is known of. wanted: of the valid lanes, within the segment.
inline __attribute__((noinline)) Place SearchRanks(const float* ranks, int length, Floats wanted,
                                                   Mask valid) {
  float least = __builtin_inff();
  const unsigned bits = Bits(valid);
  for (int i = 0; i < kLanes; ++i) {
    const float value = wanted[i];
    least = (bits >> i & 1) != 0 && value < least ? value : least;
  }
  int low = 0, high = length;  // the last rank that is not above the least is in [low, high)
  while (high - low > 1) {
    const int middle = (low + high) / 2;
    (ranks[middle] <= least ? low : high) = middle;
  }
  Ints index = {};
  for (const float* rank = ranks + low + 1; Any(valid & LessEqual(All(*rank), wanted)); ++rank) {
    index = CountUp(index, LessEqual(All(*rank), wanted));
  }
  return {low, index};
}

// What stands at two neighbouring pixels.
struct Neighbours {
  Floats rank, next_rank, column, next_column, variance, next_variance;
};

// Ranks, columns and variances of a segment from one place on.
struct SegmentArrays {
  const float *rank, *column, *variance;

  FORGESCAN_INLINE SegmentArrays(const StereoRow& row, const RowSegment& segment, int begin)
      : rank(row.ranks + segment.ranks + begin),
        column(row.column_px + segment.begin + begin),
        variance(row.variance_px2 + segment.begin + begin) {}
};

FORGESCAN_INLINE Match MatchOf(Floats wanted, Mask inside, const SlopeLimits& limits, const Neighbours& at) {
  const Floats step = at.next_rank - at.rank, inverse_step = 1 / step;
  const Floats variance = Select(Less(at.variance, at.next_variance), at.next_variance, at.variance);
  return {.found = inside & IsStep(step, limits) & IsNumber(variance),
          .part = (wanted - at.rank) * inverse_step,
          .inverse_step = inverse_step,
          .column_px = at.column,
          .column_step_px = at.next_column - at.column,
          .variance_px2 = variance};
}

inline __attribute__((noinline)) Match FindAnywhere(Floats wanted, Mask inside, const StereoRow& into,
                                                    const RowSegment& segment, const SlopeLimits& limits,
                                                    MatchHint& hint) {
  const int length = segment.end - segment.begin;
  const Place place = SearchRanks(into.ranks + segment.ranks, length, wanted, inside);
  hint.begin = place.begin;
  __builtin_memcpy(hint.index, &place.index, sizeof(hint.index));
  const SegmentArrays from(into, segment, place.begin);
  const Ints index = place.index;
  return MatchOf(
      wanted, inside, limits,
      {LookUp(from.rank, index), LookUp(from.rank + 1, index), LookUp(from.column, index),
       LookUp(from.column + 1, index), LookUp(from.variance, index), LookUp(from.variance + 1, index)});
}

FORGESCAN_INLINE Mask InSegment(Floats wanted, Mask valid, const RowSegment& segment) {
  return valid & LessEqual(All(segment.low), wanted) & LessEqual(wanted, All(segment.high));
}

// In a row of one segment. hint: where to begin; only time depends on it. Left at what suits the same columns
// of the next row.
FORGESCAN_INLINE Match FindInSegment(Floats wanted, Mask inside, const StereoRow& into,
                                     const SlopeLimits& limits, MatchHint& hint) {
  constexpr int kTries = 4;
  constexpr int kMiddle = 6;  // where the hints of a block begin
  const RowSegment& segment = into.segments[0];
  const int length = segment.end - segment.begin;
  const int begin = hint.begin < 0 ? 0 : (hint.begin < length ? hint.begin : length - 1);
  const SegmentArrays from(into, segment, begin);
  const NearTable ranks(from.rank);
  Ints index;
  __builtin_memcpy(&index, hint.index, sizeof(index));
  // Some lane nearly always has to move by one, which no processor can foretell: without a branch.
  index = CountUp(index, LessEqual(ranks[index + 1], wanted)) - CountUp(Ints{}, Less(wanted, ranks[index]));
  for (int i = 1; i < kTries; ++i) {
    const Floats rank = ranks[index], next_rank = ranks[index + 1];
    const Mask above = inside & LessEqual(next_rank, wanted), below = inside & Less(wanted, rank);
    if (!Any(above | below)) {
      index = index & (2 * kLanes - 1);
      const int shift = index[__builtin_ctz(Bits(inside))] - kMiddle;
      hint.begin = begin + shift;
      const Ints next_index = index - shift;
      __builtin_memcpy(hint.index, &next_index, sizeof(index));
      const NearTable columns(from.column), variances(from.variance);
      return MatchOf(
          wanted, inside, limits,
          {rank, next_rank, columns[index], columns[index + 1], variances[index], variances[index + 1]});
    }
    index = CountUp(index, above) - CountUp(Ints{}, below);
  }
  return FindAnywhere(wanted, inside, into, segment, limits, hint);
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
inline __attribute__((noinline)) Search FindInSegments(Floats wanted, Mask valid, const StereoRow& into,
                                                       const SlopeLimits& limits) {
  const BlockRange range = RangeOf(wanted, valid);
  Search search = {};
  search.first.found = FromBits(0);
  search.twice = FromBits(0);
  for (int i = 0; i < into.segment_count; ++i) {
    const RowSegment& segment = into.segments[i];
    if (segment.low > range.high || segment.high < range.low) {
      continue;
    }
    MatchHint unused;
    const Match match =
        FindAnywhere(wanted, InSegment(wanted, valid, segment), into, segment, limits, unused);
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

inline __attribute__((noinline)) Search FindAmongFolds(Floats wanted, Mask valid, const MatchTask& task) {
  Search search = {};
  if (task.right->segment_count > kMaxSegments) {
    search.first.found = search.twice = valid;
    return search;
  }
  search = FindInSegments(wanted, valid, *task.right, task.limits.right);
  const bool too_many = task.left->segment_count > kMaxSegments;
  const Mask again = too_many ? valid : FindInSegments(wanted, valid, *task.left, task.limits.left).twice;
  search.twice = search.twice | (search.first.found & again);
  return search;
}

FORGESCAN_INLINE Search Find(Floats wanted, Mask valid, const MatchTask& task, MatchHint& hint) {
  const StereoRow& right = *task.right;
  if (task.left->segment_count != 1 || right.segment_count != 1) {
    return FindAmongFolds(wanted, valid, task);
  }
  const Mask inside = InSegment(wanted, valid, right.segments[0]);
  if (!Any(inside)) {
    const Floats none = {};
    return {{inside, none, none, none, none, none}, inside};
  }
  return {FindInSegment(wanted, inside, right, task.limits.right, hint), FromBits(0)};
}

// Whether going there and back closes, the left row taken as straight on either side of the pixel: with a and
// b the coordinates between the pixel and its two right neighbours, back - here = a b / (a + b) (1 /
// right_step - 1 / left_step).
FORGESCAN_INLINE Mask Closes(int x, const StereoRow& left, const Match& match, const MatchLimits& limits) {
  const Floats center = Load(left.coordinate_px + x);
  const Floats left_step = center - Load(left.coordinate_px + x - 1);
  const Floats right_step = Load(left.coordinate_px + x + 1) - center;
  const Mask on_one_surface = IsStep(left_step, limits.left) & IsStep(right_step, limits.left);
  const Floats gap = match.part * (1 - match.part) * Magnitude(left_step - right_step);
  return on_one_surface &
         LessEqual(gap, limits.max_left_right_px * left_step * right_step * match.inverse_step);
}

// Bits of a block's pixels; each set is part of the one before.
struct Outcome {
  unsigned valid, found, once, good;
};

FORGESCAN_INLINE Outcome MatchBlock(const MatchTask& task, int block, const DisparityRow& disparity) {
  const StereoRow& left = *task.left;
  const int x = block * kLanes;
  const Floats wanted = Load(left.coordinate_px + x);
  const Mask valid = IsNumber(wanted);
  const Floats none = All(__builtin_nanf(""));
  if (!Any(valid)) {
    Store(disparity.disparity_px + x, none);
    return {};
  }
  // Between two right pixels that share three fifths of their noise (five-point parabolas of neighbours).
  constexpr float kUnshared = 2 * (1 - 336.0F / 595);
  const Search search = Find(wanted, valid, task, task.hints[block]);
  const Match& match = search.first;
  const Mask once = Without(match.found, search.twice);
  const Mask good = once & Closes(x, left, match, task.limits);
  const Floats partner = match.column_px + match.part * match.column_step_px;
  const Floats px_per_coordinate = match.column_step_px * match.inverse_step;
  const Floats right_variance = match.variance_px2 * (1 - kUnshared * match.part * (1 - match.part));
  const Floats variance =
      px_per_coordinate * px_per_coordinate * (Load(left.variance_px2 + x) + right_variance);
  Store(disparity.disparity_px + x, Select(good, Load(left.column_px + x) - partner, none));
  Store(disparity.variance_px2 + x, variance);
  return {Bits(valid), Bits(match.found), Bits(once), Bits(good)};
}

inline MatchCounts MatchRow(const MatchTask& task, const DisparityRow& disparity) {
  long valid = 0, found = 0, once = 0, good = 0;
  for (int block = 0; block < task.blocks; ++block) {
    FetchAhead(task.next, block);
    const Outcome outcome = MatchBlock(task, block, disparity);
    valid += __builtin_popcount(outcome.valid);
    found += __builtin_popcount(outcome.found);
    once += __builtin_popcount(outcome.once);
    good += __builtin_popcount(outcome.good);
  }
  return {
      .candidates = valid, .no_partner = valid - found, .ambiguous = found - once, .left_right = once - good};
}

}  // namespace
}  // namespace forgescan
