#include "services/reconstruction/disparity_gradient.h"

#include <algorithm>
#include <cmath>

#include "services/common/parallel_rows.h"

namespace forgescan {
namespace {

// Adds the pair (low, high), 2 k px apart. Written without branches; a NaN fails the comparison.
inline void AddPair(float low, float high, float max_step, float k, cv::Vec2f& sum) {
  const float step = high - low;
  const bool counts = std::abs(step) <= max_step;
  sum[0] += counts ? k * step : 0.0f;
  sum[1] += counts ? 2 * k * k : 0.0f;
}

}  // namespace

DisparityGradient::DisparityGradient(const cv::Mat_<float>& disparity_px, const Options& options)
    : radius_px_(options.radius_px), along_x_(disparity_px.size()), along_y_(disparity_px.size()) {
  float line_weight = 0;
  for (int k = 1; k <= radius_px_; ++k) {
    line_weight += static_cast<float>(2 * k * k);
  }
  full_weight_ = line_weight * static_cast<float>(2 * radius_px_ + 1);
  ParallelRows(options.threads, disparity_px.rows, [&](int begin, int end) {
    for (int row = begin; row < end; ++row) {
      SumPairs(disparity_px, row, static_cast<float>(options.max_slope_ratio));
    }
  });
}

void DisparityGradient::SumPairs(const cv::Mat_<float>& disparity_px, int row, float max_slope_ratio) {
  const int width = disparity_px.cols;
  const float* const here = disparity_px[row];
  cv::Vec2f* const x_sums = along_x_[row];
  cv::Vec2f* const y_sums = along_y_[row];
  std::fill_n(x_sums, width, cv::Vec2f(0, 0));
  std::fill_n(y_sums, width, cv::Vec2f(0, 0));
  for (int k = 1; k <= radius_px_; ++k) {
    const auto weight = static_cast<float>(k);
    const float step_ratio = 2 * weight * max_slope_ratio;
    for (int x = k; x < width - k; ++x) {
      AddPair(here[x - k], here[x + k], step_ratio * std::abs(here[x]), weight, x_sums[x]);
    }
    if (row < k || row + k >= disparity_px.rows) {
      continue;
    }
    const float* const above = disparity_px[row - k];
    const float* const below = disparity_px[row + k];
    for (int x = 0; x < width; ++x) {
      AddPair(above[x], below[x], step_ratio * std::abs(here[x]), weight, y_sums[x]);
    }
  }
}

std::optional<Eigen::Vector2f> DisparityGradient::At(int row, int column) const {
  cv::Vec2f x_sum(0, 0);
  for (int y = std::max(row - radius_px_, 0); y <= std::min(row + radius_px_, along_x_.rows - 1); ++y) {
    x_sum += along_x_(y, column);
  }
  cv::Vec2f y_sum(0, 0);
  for (int x = std::max(column - radius_px_, 0); x <= std::min(column + radius_px_, along_y_.cols - 1); ++x) {
    y_sum += along_y_(row, x);
  }
  const float least_weight = full_weight_ / 3;
  if (x_sum[1] < least_weight || y_sum[1] < least_weight) {
    return std::nullopt;
  }
  return Eigen::Vector2f(x_sum[0] / x_sum[1], y_sum[0] / y_sum[1]);
}

}  // namespace forgescan
