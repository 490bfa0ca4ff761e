#include "services/reconstruction/thin_cloud.h"

namespace forgescan {

PointCloud EveryNthPoint(const PointCloud& cloud, int n, int view) {
  PointCloud thin;
  for (std::size_t i = 0; i < cloud.size(); i += static_cast<std::size_t>(n)) {
    thin.points.push_back(cloud.points[i]);
    thin.normals.push_back(cloud.normals[i]);
    thin.sigma_mm.push_back(cloud.sigma_mm[i]);
  }
  thin.view.assign(thin.points.size(), static_cast<std::uint16_t>(view));
  return thin;
}

}  // namespace forgescan
