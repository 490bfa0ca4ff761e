#include "services/reconstruction/fringe_order_table.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <utility>

namespace forgescan {
namespace {

constexpr double kTwoPi = 2 * std::numbers::pi;
constexpr double kMinSeparationRad =
    0.3;  // a tenth of a half turn: ten sigma of a phase difference at sigma / B = 0.03

double CostOf(double turns) { return 1 - std::cos(kTwoPi * turns); }

// Cost between the codes of two orders that are step apart; it depends on nothing else.
double StepCost(const FringeOrderTable& table, int step) {
  return CostOf(step * static_cast<double>(table.ratios[0])) +
         CostOf(step * static_cast<double>(table.ratios[1]));
}

double RadFromCost(double cost) { return 2 * std::asin(std::sqrt(std::min(cost, 2.0) / 2)); }

double MinStepCost(const FringeOrderTable& table, int first_step, int last_step) {
  double least = 4;
  for (int step = first_step; step <= last_step; ++step) {
    least = std::min(least, StepCost(table, step));
  }
  return least;
}

FringeOrderTable OrderFrequencies(const PatternSet& pattern) {
  FringeOrderTable table;
  const auto& frequencies = pattern.frequencies;
  const auto finest =
      std::min_element(frequencies.begin(), frequencies.end(),
                       [](const auto& a, const auto& b) { return a.period_px < b.period_px; });
  table.base = static_cast<int>(finest - frequencies.begin());
  for (int j = 0; j < static_cast<int>(frequencies.size()); ++j) {
    if (j != table.base) {
      const auto at = static_cast<std::size_t>(table.other_count++);
      table.others[at] = j;
      table.ratios[at] =
          static_cast<float>(finest->period_px / frequencies[static_cast<std::size_t>(j)].period_px);
    }
  }
  return table;
}

// cost[k - first][cell] of one difference.
std::vector<std::vector<float>> CostRows(float ratio, int first, int last) {
  std::vector<std::vector<float>> rows;
  for (int k = first; k <= last; ++k) {
    auto& row = rows.emplace_back(FringeOrderTable::kSide);
    for (int cell = 0; cell < FringeOrderTable::kSide; ++cell) {
      row[static_cast<std::size_t>(cell)] =
          static_cast<float>(CostOf((cell + 0.5) / FringeOrderTable::kSide - k * static_cast<double>(ratio)));
    }
  }
  return rows;
}

void FillCells(int first, int last, double min_margin, FringeOrderTable& table) {
  const auto cost1 = CostRows(table.ratios[0], first, last);
  auto cost2 = CostRows(table.ratios[1], first, last);
  if (table.other_count == 1) {
    for (auto& row : cost2) {
      std::fill(row.begin(), row.end(), 0.0f);
    }
  }
  constexpr std::size_t kSide = FringeOrderTable::kSide;
  table.cells.resize(kSide * kSide);
  std::vector<float> best(kSide), second(kSide);
  std::vector<std::int16_t> order(kSide);
  for (std::size_t y = 0; y < kSide; ++y) {
    std::fill(best.begin(), best.end(), std::numeric_limits<float>::max());
    std::fill(second.begin(), second.end(), std::numeric_limits<float>::max());
    for (std::size_t k = 0; k < cost1.size(); ++k) {
      for (std::size_t x = 0; x < kSide; ++x) {
        const float cost = cost1[k][x] + cost2[k][y];
        const bool wins = cost < best[x];
        second[x] = wins ? best[x] : std::min(second[x], cost);
        order[x] = wins ? static_cast<std::int16_t>(first + static_cast<int>(k)) : order[x];
        best[x] = wins ? cost : best[x];
      }
    }
    for (std::size_t x = 0; x < kSide; ++x) {
      const bool doubtful = second[x] - best[x] < static_cast<float>(min_margin);
      table.cells[y * kSide + x] = {order[x], static_cast<std::int16_t>(doubtful)};
    }
  }
}

}  // namespace

Result<FringeOrderTable> MakeFringeOrderTable(const PatternSet& pattern, double margin_fraction,
                                              double dead_margin_fraction) {
  RETURN_IF_ERROR(Check(pattern));
  FringeOrderTable table = OrderFrequencies(pattern);
  const double period_px = pattern.frequencies[static_cast<std::size_t>(table.base)].period_px;
  const double first_px = -0.5;  // left edge of the first column
  const double last_px = pattern.projector_width_px - 0.5;
  int first = static_cast<int>(std::floor((first_px - pattern.phase_origin_px) / period_px));
  int last = static_cast<int>(std::ceil((last_px - pattern.phase_origin_px) / period_px)) - 1;
  const double least_cost = MinStepCost(table, 1, std::max(last - first, 1));
  table.separation_rad = RadFromCost(least_cost);
  if (table.separation_rad < kMinSeparationRad) {
    return Fail(
        ErrorCode::kDegenerate,
        "the periods of the pattern set tell its {} fringe orders apart by {:.3f} rad only, limit {} rad",
        last - first + 1, table.separation_rad, kMinSeparationRad);
  }
  table.first_px = static_cast<float>(first_px);
  table.last_px = static_cast<float>(last_px);
  // A pixel just outside the field belongs to the order before the first or after the last. Where that order
  // has a code of its own it joins the table, and such pixels fall out of range; where it does not, an edge
  // of the field stays dead.
  if (MinStepCost(table, 1, last - first + 2) >= 0.5 * least_cost) {
    --first;
    ++last;
  } else {
    const auto dead_px = static_cast<float>(dead_margin_fraction * pattern.projector_width_px);
    table.first_px += dead_px;
    table.last_px -= dead_px;
  }
  FillCells(first, last, margin_fraction * least_cost, table);
  return table;
}

}  // namespace forgescan
