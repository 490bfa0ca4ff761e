#include "services/fusion/fuse.h"

#include <algorithm>
#include <numeric>

namespace forgescan {
namespace {

void Append(const PointCloud& cloud_in_camera, const Eigen::Isometry3d& array_from_camera, double scale,
            const FuseOptions& options, PointCloud& cloud_in_array) {
  const Eigen::Matrix3f rotation = array_from_camera.linear().cast<float>();
  for (const Eigen::Vector3f& p_in_camera : cloud_in_camera.points) {
    const Eigen::Vector3d p_in_array = array_from_camera * p_in_camera.cast<double>();
    const Eigen::Vector3d scaled =
        options.fixed_in_array_mm + scale * (p_in_array - options.fixed_in_array_mm);
    cloud_in_array.points.push_back(scaled.cast<float>());
  }
  for (const Eigen::Vector3f& n_in_camera : cloud_in_camera.normals) {
    cloud_in_array.normals.push_back(rotation * n_in_camera);
  }
  cloud_in_array.sigma_mm.insert(cloud_in_array.sigma_mm.end(), cloud_in_camera.sigma_mm.begin(),
                                 cloud_in_camera.sigma_mm.end());
}

}  // namespace

Result<FusedCloud> FuseViews(std::span<const ViewCloud> views, const ViewMatrices& matrices,
                             const ExpansionCurve& curve, const FuseOptions& options) {
  FusedCloud fused;
  std::size_t total = 0;
  for (const ViewCloud& view : views) {
    if (view.view < 0 || static_cast<std::size_t>(view.view) >= matrices.array_from_camera.size()) {
      return Fail(ErrorCode::kInvalidArgument, "view {} has no view matrix; there are matrices 0 to {}",
                  view.view, matrices.array_from_camera.size() - 1);
    }
    ASSIGN_OR_RETURN(const double scale, curve.Scale(view.temperature_degc, options.reference_degc));
    fused.scales.push_back(scale);
    total += view.cloud_in_camera.size();
  }
  fused.cloud_in_array.points.reserve(total);
  fused.cloud_in_array.normals.reserve(total);
  fused.cloud_in_array.sigma_mm.reserve(total);
  fused.cloud_in_array.view.reserve(total);
  std::vector<std::size_t> order(views.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::stable_sort(order.begin(), order.end(),
                   [&](std::size_t a, std::size_t b) { return views[a].view < views[b].view; });
  for (const std::size_t i : order) {
    const ViewCloud& view = views[i];
    const Eigen::Isometry3d array_from_camera =
        matrices.array_from_camera[static_cast<std::size_t>(view.view)] * view.taught_from_actual;
    Append(view.cloud_in_camera, array_from_camera, fused.scales[i], options, fused.cloud_in_array);
    fused.cloud_in_array.view.insert(fused.cloud_in_array.view.end(), view.cloud_in_camera.size(),
                                     static_cast<std::uint16_t>(view.view));
  }
  return fused;
}

}  // namespace forgescan
