#include "services/reconstruction/stereo_strip.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>

#include "services/reconstruction/cloud_writer.h"
#include "services/reconstruction/stereo/row_arrays.h"

namespace forgescan {
namespace {

class Strip {
 public:
  Strip(const StereoTask& task, PointCloud cloud)
      : task_(task),
        radius_(task.config.normal_radius_px),
        window_(2 * radius_ + 1),
        blocks_(task.rig.left_lines.blocks_a_row()),
        kept_(kKept * window_, blocks_ * kStereoLanes),
        scratch_(kScratch, blocks_ * kStereoLanes),
        left_(blocks_, nullptr, nullptr, nullptr),
        right_(blocks_, scratch_[0], scratch_[1], scratch_[2]),
        hints_(static_cast<std::size_t>(blocks_)),
        points_(static_cast<std::size_t>((kPointFloats * (blocks_ + 1)) * kStereoLanes)),
        cloud_(std::move(cloud)) {
    if (task.rig.projector) {
      projector_ = MakeProjectorModel(*task.rig.projector, task.config);
    }
  }

  StripResult Run(int begin, int end) {
    const int height = task_.rig.size().height_px;
    for (int row = std::max(begin - radius_, 0); row < std::min(end + radius_, height); ++row) {
      const MatchCounts counts = MatchRow(row);
      if (row >= begin && row < end) {
        Count(counts);
      }
      if (row - radius_ >= begin) {
        AddPoints(row - radius_);
      }
    }
    for (int row = std::max(height - radius_, begin); row < end; ++row) {
      AddPoints(row);
    }
    result_.cloud_in_camera = std::move(cloud_).Finish();
    return std::move(result_);
  }

 private:
  static constexpr int kKept = 5;          // arrays of a row that its neighbours or its points need later
  static constexpr int kScratch = 6;       // of the right row; window sums; a row of nothing
  static constexpr int kResidualStep = 8;  // every eighth is plenty for a median
  static constexpr int kPointFloats = 9;   // of a PointRow

  float* Kept(int row, int array) { return kept_[(row % window_) * kKept + array]; }
  DisparityRow Disparity(int row) { return {Kept(row, 3), Kept(row, 4)}; }

  MatchCounts MatchRow(int row) {
    StereoRow& left = left_.row();
    left.coordinate_px = Kept(row, 0);
    left.variance_px2 = Kept(row, 1);
    left.column_px = Kept(row, 2);
    const StereoKernel& kernel = task_.kernel;
    kernel.sample(task_.left, task_.rig.left_lines.Row(row), left);
    kernel.sample(task_.right, task_.rig.right_lines.Row(row), right_.row());
    kernel.prepare(blocks_, task_.limits.left, left);
    kernel.prepare(blocks_, task_.limits.right, right_.row());
    const MatchTask match = {.left = &left,
                             .right = &right_.row(),
                             .limits = task_.limits,
                             .blocks = blocks_,
                             .next = {&task_.right, task_.rig.right_lines.Row(row)},
                             .hints = hints_.data()};
    return kernel.match(match, Disparity(row));
  }

  void Count(const MatchCounts& counts) {
    result_.count.candidates += counts.candidates;
    result_.count.no_partner += counts.no_partner;
    result_.count.ambiguous += counts.ambiguous;
    result_.count.left_right += counts.left_right;
  }

  PointGeometry Geometry(int row) const {
    const auto& config = task_.config;
    const double angle = config.max_view_angle_deg * std::numbers::pi / 180;
    const StereoRig& rig = task_.rig;
    return {.inverse_focal = static_cast<float>(1 / rig.focal_px),
            .focal_times_baseline = static_cast<float>(rig.focal_px * rig.baseline_mm),
            .row_px = static_cast<float>(row - rig.center_y_px),
            .min_depth_mm = static_cast<float>(config.min_depth_mm),
            .max_depth_mm = static_cast<float>(config.max_depth_mm),
            .squared_min_cosine = static_cast<float>(std::pow(std::cos(angle), 2)),
            .max_slope_per_disparity = static_cast<float>(std::tan(angle) / rig.focal_px),
            .radius_px = radius_,
            .sign = task_.left.sign,
            .projector = projector_ ? &*projector_ : nullptr};
  }

  static PointArray ArrayFor(float* values, float* target) {
    constexpr std::uintptr_t kLine = 64;
    const std::uintptr_t past = reinterpret_cast<std::uintptr_t>(target) % kLine;
    return {values, target, static_cast<std::ptrdiff_t>((kLine - past) % kLine / sizeof(float))};
  }

  PointRow EmptyRow() {
    const std::size_t room = points_.size() / kPointFloats;
    float* const at = points_.data();
    const int step = task_.config.keep_every_nth_point;
    const PointTargets to = step == 1 ? cloud_.Room(room) : PointTargets{};
    return {.points_mm = ArrayFor(at, to.points_mm),
            .normals = ArrayFor(at + 3 * room, to.normals),
            .sigma_mm = ArrayFor(at + 6 * room, to.sigma_mm),
            .coordinate_px = at + 7 * room,
            .residual_px = at + 8 * room,
            .count = 0,
            .residual_count = 0,
            .depth_range = 0,
            .no_normal = 0,
            .steep = 0,
            .projector = 0};
  }

  void AddPoints(int row) {
    const int height = task_.rig.size().height_px;
    std::vector<const float*> rows;
    for (int y = row - radius_; y <= row + radius_; ++y) {
      rows.push_back(y >= 0 && y < height ? Kept(y, 3) : scratch_[5]);
    }
    StereoRow left = left_.row();
    left.coordinate_px = Kept(row, 0);
    left.variance_px2 = Kept(row, 1);
    left.column_px = Kept(row, 2);
    const DisparityRow disparity = Disparity(row);
    const EpipolarTable& lines = task_.rig.left_lines;
    PointRow points = EmptyRow();
    task_.kernel.triangulate({.rows = rows.data(),
                              .left = &left,
                              .disparity = &disparity,
                              .above = lines.Row(std::max(row - 1, 0)),
                              .here = lines.Row(row),
                              .below = lines.Row(std::min(row + 1, height - 1)),
                              .sums = scratch_[3],
                              .moments = scratch_[4],
                              .blocks = blocks_,
                              .next = {&task_.left, lines.Row(std::min(row + radius_, height - 1))}},
                             Geometry(row), points);
    Append(row, points);
  }

  // What was not streamed.
  static void CopyEnds(std::ptrdiff_t count, const PointArray& array) {
    const PointArray fresh = ArrayFor(array.values, array.target);
    std::copy_n(array.values, std::min(count, fresh.streamed), array.target);
    if (array.streamed < count) {
      std::copy(array.values + array.streamed, array.values + count, array.target + array.streamed);
    }
  }

  void Append(int row, const PointRow& points) {
    const auto* const p = reinterpret_cast<const Eigen::Vector3f*>(points.points_mm.values);
    const auto* const n = reinterpret_cast<const Eigen::Vector3f*>(points.normals.values);
    const auto count = static_cast<std::size_t>(points.count);
    const int step = task_.config.keep_every_nth_point;
    if (step == 1) {
      CopyEnds(3 * points.count, points.points_mm);
      CopyEnds(3 * points.count, points.normals);
      CopyEnds(points.count, points.sigma_mm);
      cloud_.Added(count);
    } else {
      const PointSpans spans = {{p, count}, {n, count}, {points.sigma_mm.values, count}};
      cloud_.AppendThinned(spans, static_cast<std::size_t>(5 * row % step), static_cast<std::size_t>(step));
    }
    for (int i = 37 * row % task_.sample_step; i < points.count; i += task_.sample_step) {
      result_.sample.push_back({p[i], task_.left.sign * points.coordinate_px[i]});
    }
    result_.count.points += points.count;
    result_.count.depth_range += points.depth_range;
    result_.count.no_normal += points.no_normal;
    result_.count.steep += points.steep;
    result_.count.projector += points.projector;
    for (int i = row % kResidualStep; i < points.residual_count; i += kResidualStep) {
      const auto residual_px = static_cast<double>(points.residual_px[i]);
      result_.projector_residuals_px.Add(std::isnan(residual_px) ? kMaxResidualPx : residual_px);
    }
  }

  const StereoTask& task_;
  int radius_, window_, blocks_;
  RowArrays kept_, scratch_;
  PreparedRow left_, right_;
  std::vector<MatchHint> hints_;
  std::vector<float> points_;
  CloudWriter cloud_;
  std::optional<ProjectorModel> projector_;
  StripResult result_;
};

}  // namespace

StripResult ComputeStrip(const StereoTask& task, int begin, int end, PointCloud cloud) {
  return Strip(task, std::move(cloud)).Run(begin, end);
}

}  // namespace forgescan
