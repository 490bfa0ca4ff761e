#include "services/reconstruction/rectify_coordinates.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "services/common/parallel_rows.h"
#include "services/reconstruction/histogram_median.h"

namespace forgescan {
namespace {

constexpr float kNan = std::numeric_limits<float>::quiet_NaN();

// Median difference of horizontal neighbours that are both valid.
double TypicalSlope(const DecodedView& view) {
  constexpr int kRowStep = 8;       // every eighth row is plenty for a median
  constexpr double kMaxSlope = 64;  // projector px per camera px
  HistogramMedian slopes(-kMaxSlope, kMaxSlope, 1 << 15);
  for (int row = 0; row < view.cause.rows; row += kRowStep) {
    const std::uint8_t* const cause = view.cause[row];
    const float* const coordinate = view.coordinate_px[row];
    for (int x = 0; x + 1 < view.cause.cols; ++x) {
      if (cause[x] == 0 && cause[x + 1] == 0) {
        slopes.Add(static_cast<double>(coordinate[x + 1] - coordinate[x]));
      }
    }
  }
  return slopes.total() > 0 ? slopes.Median() : 0;
}

class Resampler {
 public:
  Resampler(const DecodedView& view, double max_step_px)
      : view_(view), max_step_px_(static_cast<float>(max_step_px)) {}

  void Row(const cv::Vec2f* map, float* coordinate_px, float* sigma_px) const {
    for (int x = 0; x < view_.cause.cols; ++x) {
      const auto [value, sigma] = At(map[x][0], map[x][1]);
      coordinate_px[x] = value;
      sigma_px[x] = sigma;
    }
  }

 private:
  std::pair<float, float> At(float x, float y) const {
    const bool inside = x >= 0 && y >= 0 && x < static_cast<float>(view_.cause.cols - 1) &&
                        y < static_cast<float>(view_.cause.rows - 1);
    if (!inside) {
      return {kNan, kNan};
    }
    const int column = static_cast<int>(x);
    const int row = static_cast<int>(y);
    const std::uint8_t* const cause0 = view_.cause[row] + column;
    const std::uint8_t* const cause1 = view_.cause[row + 1] + column;
    if ((cause0[0] | cause0[1] | cause1[0] | cause1[1]) != 0) {
      return {kNan, kNan};
    }
    const float* const c0 = view_.coordinate_px[row] + column;
    const float* const c1 = view_.coordinate_px[row + 1] + column;
    const auto [low, high] = std::minmax({c0[0], c0[1], c1[0], c1[1]});
    if (high - low > max_step_px_) {
      return {kNan, kNan};
    }
    const float* const s0 = view_.sigma_px[row] + column;
    const float* const s1 = view_.sigma_px[row + 1] + column;
    const float fx = x - static_cast<float>(column);
    const float fy = y - static_cast<float>(row);
    const float w00 = (1 - fx) * (1 - fy), w01 = fx * (1 - fy), w10 = (1 - fx) * fy, w11 = fx * fy;
    const float value = w00 * c0[0] + w01 * c0[1] + w10 * c1[0] + w11 * c1[1];
    const auto square = [](float v) { return v * v; };
    const float variance =
        square(w00 * s0[0]) + square(w01 * s0[1]) + square(w10 * s1[0]) + square(w11 * s1[1]);
    return {value, std::sqrt(variance)};
  }

  const DecodedView& view_;
  float max_step_px_;
};

}  // namespace

RectifiedView RectifyCoordinates(const DecodedView& view, const cv::Mat_<cv::Vec2f>& map,
                                 const ReconstructionConfig& config) {
  RectifiedView rectified;
  rectified.slope = TypicalSlope(view);
  rectified.coordinate_px.create(map.size());
  rectified.sigma_px.create(map.size());
  const Resampler resampler(view, config.max_slope_ratio * std::abs(rectified.slope));
  ParallelRows(config.threads, map.rows, [&](int begin, int end) {
    for (int row = begin; row < end; ++row) {
      resampler.Row(map[row], rectified.coordinate_px[row], rectified.sigma_px[row]);
    }
  });
  return rectified;
}

}  // namespace forgescan
