// Point clouds and triangle meshes from and to files (PLY, PCD).
#pragma once

#include <filesystem>
#include <string_view>

#include "services/common/geometry/point_cloud.h"
#include "services/common/geometry/triangle_mesh.h"
#include "services/common/result.h"

namespace forgescan {

// A cloud as it was read, and how many points of the file are not in it: those with a coordinate that is not
// finite.
struct CloudFromFile : PointCloud {
  std::size_t not_finite = 0;
};

// Reads a PLY file (ascii, binary of either byte order) or a PCD file (ascii, binary); the content decides,
// not the name. Coordinates of more than 100 m are refused: single precision does not resolve 0.01 mm there.
// Taken: x y z, the normal (nx ny nz or normal_x normal_y normal_z), sigma_mm, view; other
// properties are skipped. A point with a coordinate that is not finite is left out and counted: both formats
// write "no point" so. Units: as in the file, mm by house rule. Errors: kNotFound, kFormat; each names
// the file. A file is taken whole or not at all: in ascii one line is one row with the header's columns, and
// after the last row nothing follows. Cost: about 0.1 s per million points.
Result<CloudFromFile> ReadPointCloud(const std::filesystem::path& path);

// Reads the faces of a PLY file; a polygon becomes a fan of triangles. Errors: as above, and kFormat for a
// file without faces, an index out of range or a vertex that is not finite.
Result<TriangleMesh> ReadTriangleMesh(const std::filesystem::path& path);

// Writes binary little-endian PLY: points, and normals, sigma_mm and view where the cloud has them. A file
// is whole or not there, a pipe or device is written directly (output_file.h). Errors: kInvalidArgument
// (arrays of different length, a comment of more than one line), kIo.
Status WritePly(const std::filesystem::path& path, const PointCloud& cloud,
                const std::vector<std::string>& comments = {});

// The same on bytes in memory; name is what an error calls them.
Result<CloudFromFile> ParsePointCloud(std::string_view bytes, std::string_view name);
Result<TriangleMesh> ParseTriangleMesh(std::string_view bytes, std::string_view name);

}  // namespace forgescan
