// Which fringe a pixel sees: joint least-squares unwrapping of all frequencies by one table look-up.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "services/common/result.h"
#include "services/reconstruction/pattern_set.h"

namespace forgescan {

// Let frequency b be the finest. The differences r_j = phi_j - (L_b / L_j) phi_b (mod 1 turn) depend on the
// fringe order k alone: r_j = k L_b / L_j. The order with the least cost sum_j (1 - cos(r_j - k L_b / L_j))
// is tabulated over (r_1, r_2). Periods need not divide the projector's width. Source: paper, 2.2.1, and the
// multi-frequency look-up literature; docs/design.md, "Fringe order".
struct FringeOrderTable {
  static constexpr int kSide = 512;

  // Order k of a cell, and whether the next best order is too near to be sure. others: r_j in turns, any
  // whole number of turns up to 4 off; an absent third frequency is 0.
  struct Entry {
    std::int16_t order;
    std::int16_t is_doubtful;
  };
  const Entry& Look(float r1_turns, float r2_turns) const {
    const auto cell = [](float turns) { return static_cast<int>((turns + 4.0f) * kSide) & (kSide - 1); };
    return cells[static_cast<std::size_t>(cell(r2_turns) * kSide + cell(r1_turns))];
  }

  int base = 0;                 // index of the finest frequency
  std::array<int, 2> others{};  // indices of the other ones
  int other_count = 0;
  std::array<float, 2> ratios{};  // L_b / L_j of the others
  float first_px = 0;             // projector columns that can be decoded: [first_px, last_px]
  float last_px = 0;
  double separation_rad = 0;  // distance of the two fringe orders that are easiest to confuse
  std::vector<Entry> cells;   // kSide x kSide, second difference major
};

// margin_fraction: see ReconstructionConfig::min_unwrap_margin_fraction; dead_margin_fraction likewise.
// Errors: kDegenerate when two fringe orders inside the field cannot be told apart. Cost: about 20 ms.
Result<FringeOrderTable> MakeFringeOrderTable(const PatternSet& pattern, double margin_fraction,
                                              double dead_margin_fraction);

}  // namespace forgescan
