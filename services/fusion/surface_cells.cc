#include "services/fusion/surface_cells.h"

#include <algorithm>
#include <cmath>

namespace forgescan {
namespace {

constexpr std::int64_t kOffset = std::int64_t{1} << 31;  // keys of directions to the left are positive too

struct Item {
  std::uint64_t key;
  std::uint32_t point;
};

SurfaceCell MeanOf(const PointCloud& cloud, const Item* begin, const Item* end) {
  SurfaceCell cell{begin->key, Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero(), 0};
  const auto count = static_cast<double>(end - begin);
  for (const Item* item = begin; item != end; ++item) {
    const double sigma_mm = cloud.sigma_mm[item->point];
    cell.point += cloud.points[item->point].cast<double>() / count;
    cell.normal += cloud.normals[item->point].cast<double>() / count;
    cell.variance_mm2 += sigma_mm * sigma_mm / (count * count);
  }
  return cell;
}

double SpreadMm(const PointCloud& cloud, const Item* begin, const Item* end, const SurfaceCell& cell) {
  double squares = 0;
  for (const Item* item = begin; item != end; ++item) {
    const double off_mm = cell.normal.dot(cloud.points[item->point].cast<double>() - cell.point);
    squares += off_mm * off_mm;
  }
  return std::sqrt(squares / static_cast<double>(end - begin));
}

}  // namespace

std::uint64_t DirectionKey(const Eigen::Vector3d& p_in_camera, double cell_rad) {
  const auto place = [&](double slope) {
    return static_cast<std::uint64_t>(static_cast<std::int64_t>(std::floor(slope / cell_rad)) + kOffset);
  };
  return place(p_in_camera.y() / p_in_camera.z()) << 32 | place(p_in_camera.x() / p_in_camera.z());
}

std::vector<SurfaceCell> SurfaceCells(const PointCloud& cloud_in_camera, const SurfaceCellOptions& options) {
  std::vector<Item> items(cloud_in_camera.size());
  for (std::uint32_t i = 0; i < items.size(); ++i) {
    items[i] = {DirectionKey(cloud_in_camera.points[i].cast<double>(), options.cell_rad), i};
  }
  std::sort(items.begin(), items.end(),
            [](const Item& a, const Item& b) { return a.key != b.key ? a.key < b.key : a.point < b.point; });
  std::vector<SurfaceCell> cells;
  const Item* const end = items.data() + items.size();
  for (const Item* begin = items.data(); begin != end;) {
    const Item* next = begin;
    while (next != end && next->key == begin->key) ++next;
    if (static_cast<std::size_t>(next - begin) >= options.min_points) {
      SurfaceCell cell = MeanOf(cloud_in_camera, begin, next);
      if (cell.normal.norm() >= options.min_coherence) {
        cell.normal.normalize();
        if (SpreadMm(cloud_in_camera, begin, next, cell) <= options.max_spread_mm) cells.push_back(cell);
      }
    }
    begin = next;
  }
  return cells;
}

}  // namespace forgescan
