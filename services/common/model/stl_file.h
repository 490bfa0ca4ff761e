// STL, ascii and binary, as a welded triangle mesh.
#pragma once

#include <string>
#include <vector>

#include "services/common/geometry/triangle_index.h"
#include "services/common/result.h"

namespace forgescan {

struct StlMesh {
  std::vector<Eigen::Vector3f> vertices;  // equal positions are one vertex
  std::vector<TriangleCorners> triangles;
};

// Shape: at least one triangle. Units: those of the file, taken as mm (STL has none). The file's normals are not used:
// the corner order decides what is outside.
// Errors: kFormat with the triangle's number for a truncated file, a word out of place or a coordinate that is not finite.
Result<StlMesh> DecodeStl(const std::string& bytes);

}  // namespace forgescan
