// Corresponding pixels on one row of two rectified views: where both see the same projector column.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

namespace forgescan {

enum class MatchOutcome : std::uint8_t { kNone, kMatched, kNoPartner, kAmbiguous, kLeftRight };

// One row of a rectified view. NaN: no coordinate.
struct CoordinateRow {
  std::span<const float> coordinate_px;
  float min_slope =
      0;  // a pair of neighbours counts only if their coordinates differ by min_slope..max_slope,
  float max_slope = 0;  // both signed alike: min_slope * max_slope > 0
};

struct RowMatch {
  std::vector<float> partner_px;      // sub-pixel column in the other row; NaN unless matched
  std::vector<float> partner_slope;   // change of the coordinate per px there
  std::vector<MatchOutcome> outcome;  // one a pixel; kNone where there is no coordinate
};

// Reused from row to row; one per thread. See docs/design.md, "Stereo".
class RowMatcher {
 public:
  // coordinate_count: coordinates are searched in 0..coordinate_count px.
  explicit RowMatcher(int coordinate_count);

  // Partner of every left pixel in right: linear between two right neighbours; exactly one place may fit, in
  // either direction, and going there and back must close within max_left_right_px.
  const RowMatch& Match(const CoordinateRow& left, const CoordinateRow& right, float max_left_right_px);

 private:
  struct Entry {
    int pair;  // pixels pair and pair + 1
    int next;  // entry of the same bucket; -1: none
  };
  void Index(const CoordinateRow& row);
  void Search(const CoordinateRow& from, const CoordinateRow& into, RowMatch& match);

  std::vector<int>
      buckets_;  // by whole projector px: first entry of a list of the pairs that touch it; -1: none
  std::vector<Entry> entries_;
  RowMatch forward_;
  RowMatch backward_;
};

}  // namespace forgescan
