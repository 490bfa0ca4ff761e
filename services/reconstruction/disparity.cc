#include "services/reconstruction/disparity.h"

#include <cmath>
#include <limits>
#include <vector>

#include "services/common/parallel_rows.h"
#include "services/reconstruction/row_matcher.h"

namespace forgescan {
namespace {

struct RowCounts {
  long candidates = 0;
  long no_partner = 0;
  long ambiguous = 0;
  long left_right = 0;

  void Add(MatchOutcome outcome) {
    candidates += outcome != MatchOutcome::kNone ? 1 : 0;
    no_partner += outcome == MatchOutcome::kNoPartner ? 1 : 0;
    ambiguous += outcome == MatchOutcome::kAmbiguous ? 1 : 0;
    left_right += outcome == MatchOutcome::kLeftRight ? 1 : 0;
  }
};

CoordinateRow RowOf(const RectifiedView& view, int row, const ReconstructionConfig& config) {
  return {.coordinate_px = {view.coordinate_px[row], static_cast<std::size_t>(view.coordinate_px.cols)},
          .min_slope = static_cast<float>(config.min_slope_ratio * view.slope),
          .max_slope = static_cast<float>(config.max_slope_ratio * view.slope)};
}

Status CheckSlopes(const RectifiedView& left, const RectifiedView& right) {
  constexpr double kMinSlope =
      0.02;  // projector px per camera px: 50 camera pixels a projector column is no fringe image
  for (const RectifiedView* view : {&left, &right}) {
    if (!(std::abs(view->slope) >= kMinSlope)) {
      return Fail(ErrorCode::kDegenerate,
                  "the projector coordinate of the {} view changes by {:.4f} px per camera px along rows, "
                  "limit {}: the "
                  "view is empty or its fringes do not run across the rows",
                  view == &left ? "left" : "right", view->slope, kMinSlope);
    }
  }
  if (left.slope * right.slope < 0) {
    return Fail(ErrorCode::kDegenerate,
                "the projector coordinate runs along the rows in the left view and against them "
                "in the right one (slopes {:.3f} and {:.3f})",
                left.slope, right.slope);
  }
  return {};
}

// Largest coordinate that occurs.
int CoordinateCount(const RectifiedView& left, const RectifiedView& right) {
  double largest = 0;
  for (const RectifiedView* view : {&left, &right}) {
    for (int row = 0; row < view->coordinate_px.rows; ++row) {
      for (const float* at = view->coordinate_px[row];
           at != view->coordinate_px[row] + view->coordinate_px.cols; ++at) {
        largest = *at > largest ? static_cast<double>(*at) : largest;
      }
    }
  }
  return static_cast<int>(largest) + 2;
}

struct RowTask {
  const RectifiedView& left;
  const RectifiedView& right;
  float center_shift_px;
  DisparityMap& map;

  // Two right neighbours stand behind a match, weighted (1 - part) and part.
  RowCounts Store(int row, const RowMatch& match) const {
    RowCounts counts;
    constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
    const float* const left_sigma = left.sigma_px[row];
    const float* const right_sigma = right.sigma_px[row];
    for (std::size_t u = 0; u < match.outcome.size(); ++u) {
      const int x = static_cast<int>(u);
      counts.Add(match.outcome[u]);
      map.disparity_px(row, x) = kNan;
      map.sigma_px(row, x) = kNan;
      if (match.outcome[u] != MatchOutcome::kMatched) {
        continue;
      }
      const float partner = match.partner_px[u];
      const int v = static_cast<int>(partner);
      const float part = partner - static_cast<float>(v);
      const float near = (1 - part) * right_sigma[v];
      const float far = part * right_sigma[v + 1];
      const float coordinate_sigma = std::sqrt(left_sigma[u] * left_sigma[u] + near * near + far * far);
      map.disparity_px(row, x) = static_cast<float>(x) - partner - center_shift_px;
      map.sigma_px(row, x) = coordinate_sigma / std::abs(match.partner_slope[u]);
    }
    return counts;
  }
};

}  // namespace

Result<DisparityMap> MatchViews(const RectifiedView& left, const RectifiedView& right, const StereoRig& rig,
                                const ReconstructionConfig& config) {
  RETURN_IF_ERROR(CheckSlopes(left, right));
  DisparityMap map;
  map.disparity_px.create(left.coordinate_px.size());
  map.sigma_px.create(left.coordinate_px.size());
  const RowTask task{left, right, static_cast<float>(rig.left_center_x_px - rig.right_center_x_px), map};
  const int coordinates = CoordinateCount(left, right);
  std::vector<RowCounts> counts(static_cast<std::size_t>(left.coordinate_px.rows));
  ParallelRows(config.threads, left.coordinate_px.rows, [&](int begin, int end) {
    RowMatcher matcher(coordinates);
    for (int row = begin; row < end; ++row) {
      const RowMatch& match = matcher.Match(RowOf(left, row, config), RowOf(right, row, config),
                                            static_cast<float>(config.max_left_right_px));
      counts[static_cast<std::size_t>(row)] = task.Store(row, match);
    }
  });
  for (const RowCounts& row : counts) {
    map.candidates += row.candidates;
    map.no_partner += row.no_partner;
    map.ambiguous += row.ambiguous;
    map.left_right += row.left_right;
  }
  return map;
}

}  // namespace forgescan
