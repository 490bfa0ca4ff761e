#include <cmath>

#include "tools/virtual_station/geometry_map.h"
#include "tools/virtual_station/parallel.h"

namespace forgescan {

PosedScene::PosedScene(RayScene rays, SurfaceMesh part, SurfaceMesh cell)
    : rays_(std::move(rays)), part_in_array_(std::move(part)), cell_in_array_(std::move(cell)) {
  for (const SurfaceMesh* mesh : {&part_in_array_, &cell_in_array_}) {
    for (const auto& t : mesh->triangles) {
      const Eigen::Vector3d& a = mesh->vertices[static_cast<std::size_t>(t[0])];
      const Eigen::Vector3d& b = mesh->vertices[static_cast<std::size_t>(t[1])];
      const Eigen::Vector3d& c = mesh->vertices[static_cast<std::size_t>(t[2])];
      const Eigen::Vector3d normal = (b - a).cross(c - a).normalized();
      planes_.push_back({normal, normal.dot(a)});
    }
  }
}

Result<PosedScene> PosedScene::Build(const SurfaceMesh& mesh_in_part,
                                     const Eigen::Isometry3d& array_from_part, double scale,
                                     const SurfaceMesh& cell_in_array) {
  SurfaceMesh part_in_array = mesh_in_part;
  for (Eigen::Vector3d& v : part_in_array.vertices) {
    v = array_from_part * (scale * v);
  }
  const SurfaceMesh* surfaces[] = {&part_in_array, &cell_in_array};
  ASSIGN_OR_RETURN(RayScene rays, RayScene::Build(surfaces));
  PosedScene scene(std::move(rays), std::move(part_in_array), cell_in_array);
  scene.array_from_part_ = array_from_part;
  return scene;
}

Surface PosedScene::SurfaceOf(int triangle) const {
  if (triangle == RayScene::kNothing) {
    return Surface::kNone;
  }
  return static_cast<std::size_t>(triangle) < part_in_array_.triangles.size() ? Surface::kPart
                                                                              : Surface::kCell;
}

Eigen::Vector3d PosedScene::Meet(int triangle, const Eigen::Vector3d& origin,
                                 const Eigen::Vector3d& direction) const {
  const Plane& plane = planes_[static_cast<std::size_t>(triangle)];
  return origin + direction * ((plane.offset - plane.normal.dot(origin)) / plane.normal.dot(direction));
}

RayTable BuildRayTable(const PinholeCamera& camera, int threads) {
  RayTable table{camera.width_px, camera.height_px, {}};
  table.ray.resize(static_cast<std::size_t>(table.width) * static_cast<std::size_t>(table.height));
  ForEachIndex(table.height, threads, [&](int y) {
    Eigen::Vector2f* row = &table.ray[static_cast<std::size_t>(y) * static_cast<std::size_t>(table.width)];
    for (int x = 0; x < table.width; ++x) {
      row[x] = Unproject(camera.lens, {x, y}).cast<float>();
    }
  });
  return table;
}

}  // namespace forgescan
