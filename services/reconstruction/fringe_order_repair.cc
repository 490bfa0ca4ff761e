#include "services/reconstruction/fringe_order_repair.h"

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>
#include <optional>
#include <vector>

namespace forgescan {
namespace {

constexpr auto kValid = static_cast<std::uint8_t>(MaskCause::kValid);
constexpr int kRadiusPx = 2;

struct Repair {
  int row;
  int column;
  float coordinate_px;
};

std::optional<float> MedianOfNeighbours(const DecodedView& view, int row, int column, int min_neighbours) {
  std::array<float, 25> values;
  int count = 0;
  for (int y = std::max(row - kRadiusPx, 0); y <= std::min(row + kRadiusPx, view.cause.rows - 1); ++y) {
    for (int x = std::max(column - kRadiusPx, 0); x <= std::min(column + kRadiusPx, view.cause.cols - 1);
         ++x) {
      if (view.cause(y, x) == kValid) {
        values[static_cast<std::size_t>(count++)] = view.coordinate_px(y, x);
      }
    }
  }
  if (count < min_neighbours) {
    return std::nullopt;
  }
  std::nth_element(values.begin(), values.begin() + count / 2, values.begin() + count);
  return values[static_cast<std::size_t>(count / 2)];
}

}  // namespace

long RepairFringeOrders(DecodedView& view, double period_px, const ReconstructionConfig& config) {
  constexpr auto kDoubtful = static_cast<std::uint8_t>(MaskCause::kUnwrapMargin);
  const auto period = static_cast<float>(period_px);
  const auto tolerance_px = static_cast<float>(config.repair_tolerance_periods) * period;
  std::vector<Repair> repairs;
  for (int row = 0; row < view.cause.rows; ++row) {
    for (int column = 0; column < view.cause.cols; ++column) {
      if (view.cause(row, column) != kDoubtful) {
        continue;
      }
      const auto median = MedianOfNeighbours(view, row, column, config.repair_min_neighbours);
      if (!median) {
        continue;
      }
      const float coordinate = view.coordinate_px(row, column);
      const float moved = coordinate - period * std::round((coordinate - *median) / period);
      if (std::abs(moved - *median) <= tolerance_px) {
        repairs.push_back({row, column, moved});
      }
    }
  }
  for (const Repair& repair : repairs) {
    view.coordinate_px(repair.row, repair.column) = repair.coordinate_px;
    view.cause(repair.row, repair.column) = kValid;
  }
  return static_cast<long>(repairs.size());
}

void DropMaskBorder(DecodedView& view, const ReconstructionConfig& config) {
  if (config.mask_border_px == 0) {
    return;
  }
  const int side = 2 * config.mask_border_px + 1;
  const cv::Mat valid = view.cause == kValid;
  cv::Mat kept;
  cv::erode(valid, kept, cv::Mat::ones(side, side, CV_8U));
  view.cause.setTo(static_cast<int>(MaskCause::kBorder), valid & ~kept);
}

}  // namespace forgescan
