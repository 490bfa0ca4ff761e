#include "services/reconstruction/stereo_points.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "services/common/parallel_rows.h"
#include "services/reconstruction/cloud_writer.h"
#include "services/reconstruction/histogram_median.h"
#include "services/reconstruction/stereo_strip.h"

namespace forgescan {
namespace {

// Median difference of horizontal neighbours that are both valid, with sign; 0: none.
double TypicalSlope(const DecodedView& view) {
  constexpr int kRows = 32;         // plenty for a median
  constexpr double kMaxSlope = 64;  // projector px per camera px
  HistogramMedian slopes(-kMaxSlope, kMaxSlope, 1 << 15);
  const int step = std::max(view.cause.rows / kRows, 1);
  for (int row = step / 2; row < view.cause.rows; row += step) {
    const float* const coordinate = view.coordinate_px[row];
    for (int x = 0; x + 1 < view.cause.cols; ++x) {
      const double slope = static_cast<double>(coordinate[x + 1] - coordinate[x]);
      if (std::isfinite(slope)) {
        slopes.Add(slope);
      }
    }
  }
  return slopes.total() > 0 ? slopes.Median() : 0;
}

Status CheckSlopes(double left, double right) {
  constexpr double kMinSlope =
      0.02;  // projector px per camera px: 50 camera pixels a projector column is no fringe image
  for (const double slope : {left, right}) {
    if (!(std::abs(slope) >= kMinSlope)) {
      return Fail(ErrorCode::kDegenerate,
                  "the projector coordinate of the {} view changes by {:.4f} px per camera px along rows, "
                  "limit {}: the view is empty or its fringes do not run across the rows",
                  std::abs(left) >= kMinSlope ? "right" : "left", slope, kMinSlope);
    }
  }
  if (left * right < 0) {
    return Fail(ErrorCode::kDegenerate,
                "the projector coordinate runs along the rows in the left view and against them "
                "in the right one (slopes {:.3f} and {:.3f})",
                left, right);
  }
  return {};
}

Status CheckSize(const DecodedView& view, const StereoRig& rig) {
  const cv::Size size(rig.size().width_px, rig.size().height_px);
  const cv::Size half(size.width, (size.height + 1) / 2);
  if (view.cause.size() != size || view.coordinate_px.size() != size || view.variance_px2.size() != half) {
    return Fail(ErrorCode::kInvalidArgument, "the views have {} x {} px, prepared were {} x {}",
                view.cause.cols, view.cause.rows, size.width, size.height);
  }
  return {};
}

RawView ViewOf(const DecodedView& view, double slope, const ReconstructionConfig& config) {
  return {.coordinate_px = view.coordinate_px[0],
          .variance_px2 = view.variance_px2[0],
          .coordinate_stride = static_cast<std::ptrdiff_t>(view.coordinate_px.step1()),
          .variance_stride = static_cast<std::ptrdiff_t>(view.variance_px2.step1()),
          .width = view.cause.cols,
          .height = view.cause.rows,
          .max_step_px = static_cast<float>(config.max_slope_ratio * std::abs(slope)),
          .sign = slope < 0 ? -1.0F : 1.0F};
}

SlopeLimits LimitsOf(double slope, const ReconstructionConfig& config) {
  return {.low = static_cast<float>(config.min_slope_ratio * std::abs(slope)),
          .high = static_cast<float>(config.max_slope_ratio * std::abs(slope)),
          .max_off_px = static_cast<float>(config.max_left_right_px * std::abs(slope))};
}

std::vector<LitPoint> Thinned(const std::vector<LitPoint>& sample) {
  constexpr std::size_t kWanted = 4000;
  const std::size_t step = sample.size() / kWanted + 1;
  std::vector<LitPoint> thinned;
  for (std::size_t i = step / 2; i < sample.size(); i += step) {
    thinned.push_back(sample[i]);
  }
  return thinned;
}

void Add(const StereoCounts& other, StereoCounts& sum) {
  sum.candidates += other.candidates;
  sum.no_partner += other.no_partner;
  sum.ambiguous += other.ambiguous;
  sum.left_right += other.left_right;
  sum.depth_range += other.depth_range;
  sum.no_normal += other.no_normal;
  sum.steep += other.steep;
  sum.projector += other.projector;
  sum.points += other.points;
}

StereoPoints Join(std::vector<StripResult> strips) {
  StereoPoints joined;
  HistogramMedian& residuals = strips[0].projector_residuals_px;
  std::vector<LitPoint>& sample = strips[0].sample;
  const std::size_t first = strips[0].cloud_in_camera.size();
  CloudWriter cloud(std::move(strips[0].cloud_in_camera), first);
  for (std::size_t i = 0; i < strips.size(); ++i) {
    Add(strips[i].count, joined.count);
    if (i > 0) {
      const PointCloud& part = strips[i].cloud_in_camera;
      cloud.Append({part.points, part.normals, part.sigma_mm});
      sample.insert(sample.end(), strips[i].sample.begin(), strips[i].sample.end());
      residuals.Add(strips[i].projector_residuals_px);
      joined.spare.push_back(std::move(strips[i].cloud_in_camera));
    }
  }
  joined.cloud_in_camera = std::move(cloud).Finish();
  joined.sample = Thinned(sample);
  if (residuals.total() > 0) {
    joined.median_projector_residual_px = residuals.Median();
  }
  return joined;
}

}  // namespace

Result<StereoPoints> ComputeStereoPoints(const DecodedView& left, const DecodedView& right,
                                         const StereoRig& rig, const ReconstructionConfig& config,
                                         StereoPoints recycled) {
  RETURN_IF_ERROR(CheckSize(left, rig));
  RETURN_IF_ERROR(CheckSize(right, rig));
  const double left_slope = TypicalSlope(left), right_slope = TypicalSlope(right);
  RETURN_IF_ERROR(CheckSlopes(left_slope, right_slope));
  constexpr int kSampled = 65536;  // points looked at for a sample of 4000
  const int height = rig.size().height_px, width = rig.size().width_px;
  const StereoTask task = {.kernel = *StereoKernels().front(),
                           .left = ViewOf(left, left_slope, config),
                           .right = ViewOf(right, right_slope, config),
                           .limits = {.left = LimitsOf(left_slope, config),
                                      .right = LimitsOf(right_slope, config),
                                      .max_left_right_px = static_cast<float>(config.max_left_right_px)},
                           .rig = rig,
                           .config = config,
                           .sample_step = std::max(width * height / kSampled, 1)};
  const int count = std::clamp(config.threads, 1, height);
  std::vector<StripResult> strips(static_cast<std::size_t>(count));
  recycled.spare.resize(static_cast<std::size_t>(count - 1));
  ParallelRows(count, count, [&](int begin, int end) {
    for (int i = begin; i < end; ++i) {
      const auto at = static_cast<std::size_t>(i);
      PointCloud& memory = i == 0 ? recycled.cloud_in_camera : recycled.spare[at - 1];
      strips[at] = ComputeStrip(task, height * i / count, height * (i + 1) / count, std::move(memory));
    }
  });
  return Join(std::move(strips));
}

}  // namespace forgescan
