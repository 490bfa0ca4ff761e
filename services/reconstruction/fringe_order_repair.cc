#include "services/reconstruction/fringe_order_repair.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <optional>
#include <vector>

#include "services/common/parallel_rows.h"

namespace forgescan {
namespace {

constexpr auto kValid = static_cast<std::uint8_t>(MaskCause::kValid);
constexpr int kRadiusPx = 2;

const std::uint8_t* FindByte(const std::uint8_t* begin, const std::uint8_t* end, std::uint8_t byte) {
  const void* const found = std::memchr(begin, byte, static_cast<std::size_t>(end - begin));
  return found == nullptr ? end : static_cast<const std::uint8_t*>(found);
}

struct Repair {
  int row;
  int column;
  float coordinate_px;         // NaN: none
  std::uint16_t variance_px2;  // see Neighbours
};

struct Neighbours {
  float median_px;
  std::uint16_t variance_px2;  // largest, of even rows; 0: none of them is in an even row
};

std::optional<Neighbours> ValidNeighbours(const DecodedView& view, int row, int column, int min_neighbours) {
  std::array<float, 25> values;
  std::uint16_t variance_px2 = 0;  // halves of positive floats are in the order of the floats
  int count = 0;
  for (int y = std::max(row - kRadiusPx, 0); y <= std::min(row + kRadiusPx, view.cause.rows - 1); ++y) {
    for (int x = std::max(column - kRadiusPx, 0); x <= std::min(column + kRadiusPx, view.cause.cols - 1);
         ++x) {
      if (view.cause(y, x) == kValid) {
        values[static_cast<std::size_t>(count++)] = view.coordinate_px(y, x);
        variance_px2 = y % 2 == 0 ? std::max(variance_px2, view.variance_px2(y / 2, x)) : variance_px2;
      }
    }
  }
  if (count < min_neighbours) {
    return std::nullopt;
  }
  std::nth_element(values.begin(), values.begin() + count / 2, values.begin() + count);
  return Neighbours{values[static_cast<std::size_t>(count / 2)], variance_px2};
}

// Repairs of one row, decided on the view as it is.
class RowRepair {
 public:
  RowRepair(const DecodedView& view, double period_px, const ReconstructionConfig& config)
      : view_(view),
        period_px_(static_cast<float>(period_px)),
        tolerance_px_(static_cast<float>(config.repair_tolerance_periods * period_px)),
        min_neighbours_(config.repair_min_neighbours) {}

  std::vector<Repair> Row(int row) const {
    constexpr auto kDoubtful = static_cast<std::uint8_t>(MaskCause::kUnwrapMargin);
    std::vector<Repair> repairs;
    const std::uint8_t* const cause = view_.cause[row];
    const std::uint8_t* const end = cause + view_.cause.cols;
    for (const std::uint8_t* at = cause; (at = FindByte(at, end, kDoubtful)) != end; ++at) {
      repairs.push_back(Pixel(row, static_cast<int>(at - cause)));
    }
    return repairs;
  }

 private:
  Repair Pixel(int row, int column) const {
    Repair repair = {row, column, std::numeric_limits<float>::quiet_NaN(), 0};
    if (const auto neighbours = ValidNeighbours(view_, row, column, min_neighbours_)) {
      const float coordinate = view_.coordinate_px(row, column);
      const float moved =
          coordinate - period_px_ * std::round((coordinate - neighbours->median_px) / period_px_);
      if (std::abs(moved - neighbours->median_px) <= tolerance_px_) {
        repair.coordinate_px = moved;
        repair.variance_px2 = neighbours->variance_px2;
      }
    }
    return repair;
  }

  const DecodedView& view_;
  float period_px_;
  float tolerance_px_;
  int min_neighbours_;
};

}  // namespace

long RepairFringeOrders(const std::vector<std::uint8_t>& doubtful_rows, double period_px,
                        const ReconstructionConfig& config, MaskMap& masked, DecodedView& view) {
  const RowRepair repair(view, period_px, config);
  std::vector<std::vector<Repair>> rows(static_cast<std::size_t>(view.cause.rows));
  ParallelRows(config.threads, view.cause.rows, [&](int begin, int end) {
    for (int row = begin; row < end; ++row) {
      if (doubtful_rows[static_cast<std::size_t>(row)] != 0) {
        rows[static_cast<std::size_t>(row)] = repair.Row(row);
      }
    }
  });
  long count = 0;
  for (const auto& row : rows) {
    for (const Repair& one : row) {
      view.coordinate_px(one.row, one.column) = one.coordinate_px;
      if (std::isnan(one.coordinate_px)) {
        continue;
      }
      if (one.row % 2 == 0 && one.variance_px2 > 0) {
        view.variance_px2(one.row / 2, one.column) = one.variance_px2;
      }
      view.cause(one.row, one.column) = kValid;
      masked.Unmask(one.row, one.column, MaskCause::kUnwrapMargin);
      ++count;
    }
  }
  return count;
}

}  // namespace forgescan
