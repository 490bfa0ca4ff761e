// A surface of triangles, as STL and PLY files carry it.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <vector>

namespace forgescan {

// Shape: triangles hold indices into vertices, counter-clockwise seen from outside. Units: mm. Frames: named
// by the variable that holds the mesh.
struct TriangleMesh {
  std::vector<Eigen::Vector3f> vertices;
  std::vector<std::array<std::uint32_t, 3>> triangles;
};

}  // namespace forgescan
