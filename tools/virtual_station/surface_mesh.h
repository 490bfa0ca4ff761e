// A closed or open triangle surface of the simulated cell.
#pragma once

#include <Eigen/Core>
#include <array>
#include <vector>

namespace forgescan {

// Units: mm. Frames: the frame is part of the name of the variable that holds it (mesh_in_part,
// mesh_in_array). double: the simulator's truth must be much finer than what the reconstruction resolves.
struct SurfaceMesh {
  std::vector<Eigen::Vector3d> vertices;
  std::vector<std::array<int, 3>> triangles;  // outward by the right-hand rule
};

// Adds all of `added` to `mesh`.
inline void Append(const SurfaceMesh& added, SurfaceMesh& mesh) {
  const int first = static_cast<int>(mesh.vertices.size());
  mesh.vertices.insert(mesh.vertices.end(), added.vertices.begin(), added.vertices.end());
  for (const auto& t : added.triangles) {
    mesh.triangles.push_back({t[0] + first, t[1] + first, t[2] + first});
  }
}

}  // namespace forgescan
