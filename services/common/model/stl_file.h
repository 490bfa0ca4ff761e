// STL, ascii and binary, as a welded triangle mesh.
#pragma once

#include <string>

#include "services/common/geometry/triangle_mesh.h"
#include "services/common/result.h"

namespace forgescan {

// Shape: at least one triangle; corners at equal positions are one vertex. Units: those of the file, taken as
// mm (STL has none). The file's normals are not used: the corner order decides what is outside. Errors:
// kFormat with the triangle's number for a truncated file, a word out of place or a coordinate that is not
// finite.
Result<TriangleMesh> DecodeStl(const std::string& bytes);

}  // namespace forgescan
