#include "services/reconstruction/triangulate.h"

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <opencv2/calib3d.hpp>
#include <opencv2/core/eigen.hpp>
#include <vector>

#include "services/common/parallel_rows.h"
#include "services/reconstruction/disparity_gradient.h"
#include "services/reconstruction/histogram_median.h"

namespace forgescan {
namespace {

struct Candidate {
  Eigen::Vector3f p_in_camera;
  Eigen::Vector3f normal;
  float sigma_mm;
  float coordinate_px;
  float coordinate_sigma_px;
};

// What one row yields; rows are joined in order afterwards.
struct RowResult {
  std::vector<Candidate> candidates;
  std::vector<float> projector_residuals_px;
  long depth_range = 0;
  long no_normal = 0;
  long steep = 0;
  long projector = 0;
};

class RowTriangulator {
 public:
  RowTriangulator(const DisparityMap& map, const RectifiedView& left, const StereoRig& rig,
                  const ReconstructionConfig& config)
      : map_(map),
        left_(left),
        rig_(rig),
        config_(config),
        min_cosine_(static_cast<float>(std::cos(config.max_view_angle_deg * std::numbers::pi / 180))),
        gradient_(
            map.disparity_px,
            {.radius_px = config.normal_radius_px,
             .max_slope_ratio = std::tan(config.max_view_angle_deg * std::numbers::pi / 180) / rig.focal_px,
             .threads = config.threads}) {}

  RowResult Row(int row) const {
    RowResult result;
    for (int column = 0; column < map_.disparity_px.cols; ++column) {
      if (!std::isnan(map_.disparity_px(row, column))) {
        AddPoint(row, column, result);
      }
    }
    if (rig_.projector && !result.candidates.empty()) {
      CheckWithProjector(result);
    }
    return result;
  }

 private:
  void AddPoint(int row, int column, RowResult& result) const {
    const double disparity = static_cast<double>(map_.disparity_px(row, column));
    const double depth_mm = rig_.focal_px * rig_.baseline_mm / disparity;
    if (!(depth_mm >= config_.min_depth_mm && depth_mm <= config_.max_depth_mm)) {
      ++result.depth_range;
      return;
    }
    const auto gradient = gradient_.At(row, column);
    if (!gradient) {
      ++result.no_normal;
      return;
    }
    const double x = (column - rig_.left_center_x_px) / rig_.focal_px;
    const double y = (row - rig_.center_y_px) / rig_.focal_px;
    const Eigen::Vector3d ray(x, y, 1);
    // A plane n.p = c has the disparity (f b / c) n.ray: its gradient over x, y is (b / c) (nx, ny).
    const double gx = static_cast<double>(gradient->x()), gy = static_cast<double>(gradient->y());
    Eigen::Vector3d normal(gx, gy, disparity / rig_.focal_px - gx * x - gy * y);
    normal *= (normal.dot(ray) > 0 ? -1 : 1) / normal.norm();
    if (-normal.dot(ray.normalized()) < static_cast<double>(min_cosine_)) {
      ++result.steep;
      return;
    }
    const double sigma_mm =
        depth_mm / std::abs(disparity) * static_cast<double>(map_.sigma_px(row, column)) * ray.norm();
    result.candidates.push_back({.p_in_camera = (depth_mm * ray).cast<float>(),
                                 .normal = normal.cast<float>(),
                                 .sigma_mm = static_cast<float>(sigma_mm),
                                 .coordinate_px = left_.coordinate_px(row, column),
                                 .coordinate_sigma_px = left_.sigma_px(row, column)});
  }

  void CheckWithProjector(RowResult& result) const {
    std::vector<cv::Point3f> points;
    for (const Candidate& candidate : result.candidates) {
      points.emplace_back(candidate.p_in_camera.x(), candidate.p_in_camera.y(), candidate.p_in_camera.z());
    }
    cv::Mat rotation, translation, camera, rotation_vector;
    cv::eigen2cv(rig_.projector->projector_from_left.rotation, rotation);
    cv::eigen2cv(rig_.projector->projector_from_left.translation_mm, translation);
    cv::eigen2cv(rig_.projector->intrinsics.camera_matrix, camera);
    cv::Rodrigues(rotation, rotation_vector);
    std::vector<cv::Point2f> projected;
    cv::projectPoints(points, rotation_vector, translation, camera, rig_.projector->intrinsics.distortion,
                      projected);
    std::vector<Candidate> kept;
    for (std::size_t i = 0; i < points.size(); ++i) {
      const Candidate& candidate = result.candidates[i];
      const float residual_px = candidate.coordinate_px - projected[i].x;
      const float limit_px =
          std::max(static_cast<float>(config_.max_projector_residual_px),
                   static_cast<float>(config_.max_projector_residual_sigma) * candidate.coordinate_sigma_px);
      result.projector_residuals_px.push_back(residual_px);
      if (std::abs(residual_px) <= limit_px) {
        kept.push_back(candidate);
      } else {
        ++result.projector;
      }
    }
    result.candidates = std::move(kept);
  }

  const DisparityMap& map_;
  const RectifiedView& left_;
  const StereoRig& rig_;
  const ReconstructionConfig& config_;
  float min_cosine_;
  DisparityGradient gradient_;
};

std::vector<LitPoint> Sample(const std::vector<RowResult>& rows, std::size_t total) {
  constexpr std::size_t kWanted = 4000;
  const std::size_t step = total / kWanted + 1;
  std::vector<LitPoint> sample;
  std::size_t next = step / 2;
  std::size_t first = 0;  // of the row, among all candidates
  for (const RowResult& row : rows) {
    for (; next < first + row.candidates.size(); next += step) {
      const Candidate& candidate = row.candidates[next - first];
      sample.push_back({candidate.p_in_camera, candidate.coordinate_px});
    }
    first += row.candidates.size();
  }
  return sample;
}

Triangulation Join(const std::vector<RowResult>& rows) {
  Triangulation joined;
  std::size_t total = 0;
  for (const RowResult& row : rows) {
    total += row.candidates.size();
  }
  joined.sample = Sample(rows, total);
  joined.cloud_in_camera.points.reserve(total);
  joined.cloud_in_camera.normals.reserve(total);
  joined.cloud_in_camera.sigma_mm.reserve(total);
  constexpr double kMaxResidualPx = 64;
  HistogramMedian residual(-kMaxResidualPx, kMaxResidualPx, 1 << 15);
  for (const RowResult& row : rows) {
    for (const Candidate& candidate : row.candidates) {
      joined.cloud_in_camera.points.push_back(candidate.p_in_camera);
      joined.cloud_in_camera.normals.push_back(candidate.normal);
      joined.cloud_in_camera.sigma_mm.push_back(candidate.sigma_mm);
    }
    for (const float residual_px : row.projector_residuals_px) {
      residual.Add(static_cast<double>(residual_px));
    }
    joined.depth_range += row.depth_range;
    joined.no_normal += row.no_normal;
    joined.steep += row.steep;
    joined.projector += row.projector;
  }
  if (residual.total() > 0) {
    joined.median_projector_residual_px = residual.Median();
  }
  return joined;
}

}  // namespace

Triangulation Triangulate(const DisparityMap& map, const RectifiedView& left, const StereoRig& rig,
                          const ReconstructionConfig& config) {
  const RowTriangulator triangulator(map, left, rig, config);
  std::vector<RowResult> rows(static_cast<std::size_t>(map.disparity_px.rows));
  ParallelRows(config.threads, map.disparity_px.rows, [&](int begin, int end) {
    for (int row = begin; row < end; ++row) {
      rows[static_cast<std::size_t>(row)] = triangulator.Row(row);
    }
  });
  return Join(rows);
}

}  // namespace forgescan
