#include "services/fusion/standing_surfaces.h"

#include <algorithm>
#include <cmath>

namespace forgescan {
namespace {

// Of motions far below 1 rad, whose vectors may be added.
Eigen::Isometry3d MeanOf(const std::vector<Eigen::Isometry3d>& motions) {
  Eigen::Vector3d shift = Eigen::Vector3d::Zero(), turn = Eigen::Vector3d::Zero();
  for (const Eigen::Isometry3d& motion : motions) {
    const Eigen::AngleAxisd part(motion.linear());
    shift += motion.translation();
    turn += part.angle() * part.axis();
  }
  shift /= static_cast<double>(motions.size());
  turn /= static_cast<double>(motions.size());
  const double angle = turn.norm();
  const Eigen::Vector3d axis = angle > 0 ? Eigen::Vector3d(turn / angle) : Eigen::Vector3d::UnitX();
  return Eigen::Translation3d(shift) * Eigen::AngleAxisd(angle, axis);
}

void Append(const PointCloud& cloud, const Eigen::Isometry3d& moved_from_cloud, PointCloud& moved) {
  for (const Eigen::Vector3f& p : cloud.points) {
    moved.points.push_back((moved_from_cloud * p.cast<double>()).cast<float>());
  }
  for (const Eigen::Vector3f& n : cloud.normals) {
    moved.normals.push_back((moved_from_cloud.linear() * n.cast<double>()).cast<float>());
  }
  moved.sigma_mm.insert(moved.sigma_mm.end(), cloud.sigma_mm.begin(), cloud.sigma_mm.end());
}

std::vector<SurfaceCell> InRegions(const std::vector<SurfaceCell>& cells,
                                   const Eigen::Isometry3d& array_from_camera,
                                   std::span<const Eigen::AlignedBox3d> regions) {
  std::vector<SurfaceCell> inside;
  for (const SurfaceCell& cell : cells) {
    const Eigen::Vector3d p_in_array = array_from_camera * cell.point;
    const bool counts =
        std::ranges::any_of(regions, [&](const auto& region) { return region.contains(p_in_array); });
    if (counts) inside.push_back(cell);
  }
  return inside;
}

// The clouds of one view where the mean of their visits stood.
Result<PointCloud> Averaged(const std::vector<const PointCloud*>& clouds, int view,
                            const StandingRequest& request) {
  const std::vector<SurfaceCell> first =
      InRegions(SurfaceCells(*clouds.front(), request.visit.cells),
                request.matrices.array_from_camera[static_cast<std::size_t>(view)], request.regions);
  const VisitErrorOptions of_two = AgainstMeanOf(1, request.visit);
  std::vector<Eigen::Isometry3d> first_from_visit{Eigen::Isometry3d::Identity()};
  for (std::size_t i = 1; i < clouds.size(); ++i) {
    const auto error = EstimateVisitError(first, *clouds[i], of_two);
    if (!error.ok()) {
      return Fail(error.error().code, "view {}: scan {} against the first: {}", view, i + 1,
                  error.error().message);
    }
    first_from_visit.push_back(error->taught_from_actual);
  }
  const Eigen::Isometry3d mean_from_first = MeanOf(first_from_visit).inverse();
  PointCloud all;
  for (std::size_t i = 0; i < clouds.size(); ++i) {
    Append(*clouds[i], mean_from_first * first_from_visit[i], all);
  }
  return all;
}

Status Check(std::span<const std::vector<ViewCloud>> scans, const StandingRequest& request) {
  if (scans.empty() || request.regions.empty()) {
    return Fail(ErrorCode::kInvalidArgument,
                "standing surfaces need at least one scan and one region; there are {} and {}", scans.size(),
                request.regions.size());
  }
  const auto views = static_cast<int>(request.matrices.array_from_camera.size());
  for (const auto& scan : scans) {
    for (const ViewCloud& view : scan) {
      if (view.view < 0 || view.view >= views) {
        return Fail(ErrorCode::kInvalidArgument, "view {} has no view matrix; there are matrices 0 to {}",
                    view.view, views - 1);
      }
    }
  }
  return {};
}

}  // namespace

VisitErrorOptions AgainstMeanOf(int scans, VisitErrorOptions options) {
  const double factor = std::sqrt(1 + 1.0 / scans);
  options.robot_shift_mm *= factor;
  options.robot_turn_rad *= factor;
  return options;
}

Result<StandingSurfaces> MakeStandingSurfaces(std::span<const std::vector<ViewCloud>> scans,
                                              const StandingRequest& request) {
  RETURN_IF_ERROR(Check(scans, request));
  StandingSurfaces standing{request.origin, request.visit.cells.cell_rad, static_cast<int>(scans.size()), {}};
  const auto& matrices = request.matrices.array_from_camera;
  standing.views.resize(matrices.size());
  std::size_t cells = 0;
  for (std::size_t k = 0; k < matrices.size(); ++k) {
    std::vector<const PointCloud*> clouds;
    for (const auto& scan : scans) {
      for (const ViewCloud& view : scan) {
        if (view.view == static_cast<int>(k)) clouds.push_back(&view.cloud_in_camera);
      }
    }
    if (clouds.empty()) continue;
    ASSIGN_OR_RETURN(const PointCloud cloud, Averaged(clouds, static_cast<int>(k), request));
    standing.views[k] = InRegions(SurfaceCells(cloud, request.visit.cells), matrices[k], request.regions);
    cells += standing.views[k].size();
  }
  if (cells == 0) {
    return Fail(ErrorCode::kUntrusted, "the scans show no surface in any of the {} regions",
                request.regions.size());
  }
  return standing;
}

}  // namespace forgescan
