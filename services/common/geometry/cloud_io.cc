#include "services/common/geometry/cloud_io.h"

#include <array>
#include <bit>
#include <string>

#include "services/common/input_file.h"
#include "services/common/output_file.h"

namespace forgescan {
namespace {

template <typename T>
void Append(std::string& bytes, const T& value) {
  static_assert(std::endian::native == std::endian::little);
  bytes.append(reinterpret_cast<const char*>(&value), sizeof(T));
}

std::string EncodePly(const PointCloud& cloud, const std::vector<std::string>& comments) {
  std::string bytes = "ply\nformat binary_little_endian 1.0\ncomment units: mm\n";
  for (const std::string& comment : comments) bytes += "comment " + comment + "\n";
  bytes +=
      fmt::format("element vertex {}\nproperty float x\nproperty float y\nproperty float z\n", cloud.size());
  bytes += cloud.normals.empty() ? "" : "property float nx\nproperty float ny\nproperty float nz\n";
  bytes += cloud.sigma_mm.empty() ? "" : "property float sigma_mm\n";
  bytes += cloud.view.empty() ? "" : "property ushort view\n";
  bytes += "end_header\n";
  for (std::size_t i = 0; i < cloud.size(); ++i) {
    Append(bytes, std::array<float, 3>{cloud.points[i].x(), cloud.points[i].y(), cloud.points[i].z()});
    if (!cloud.normals.empty()) {
      Append(bytes, std::array<float, 3>{cloud.normals[i].x(), cloud.normals[i].y(), cloud.normals[i].z()});
    }
    if (!cloud.sigma_mm.empty()) {
      Append(bytes, cloud.sigma_mm[i]);
    }
    if (!cloud.view.empty()) {
      Append(bytes, cloud.view[i]);
    }
  }
  return bytes;
}

}  // namespace

Result<CloudFromFile> ReadPointCloud(const std::filesystem::path& path) {
  ASSIGN_OR_RETURN(const std::string bytes, ReadInputFile(path));
  return ParsePointCloud(bytes, path.string());
}

Result<TriangleMesh> ReadTriangleMesh(const std::filesystem::path& path) {
  ASSIGN_OR_RETURN(const std::string bytes, ReadInputFile(path));
  return ParseTriangleMesh(bytes, path.string());
}

Status WritePly(const std::filesystem::path& path, const PointCloud& cloud,
                const std::vector<std::string>& comments) {
  const auto fits = [&cloud](std::size_t n) { return n == 0 || n == cloud.size(); };
  if (!fits(cloud.normals.size()) || !fits(cloud.sigma_mm.size()) || !fits(cloud.view.size())) {
    return Fail(ErrorCode::kInvalidArgument,
                "{}: the cloud has {} points but {} normals, {} sigmas and {} views", path.string(),
                cloud.size(), cloud.normals.size(), cloud.sigma_mm.size(), cloud.view.size());
  }
  for (const std::string& comment : comments) {
    if (comment.find('\n') != std::string::npos) {
      return Fail(ErrorCode::kInvalidArgument, "{}: the comment \"{}\" has more than one line", path.string(),
                  comment);
    }
  }
  return WriteOutputFile(path, EncodePly(cloud, comments));
}

}  // namespace forgescan
