#include <cmath>
#include <optional>
#include <utility>

#include "services/common/geometry/cloud_builder.h"
#include "services/common/geometry/cloud_io.h"
#include "services/common/geometry/pcd_format.h"
#include "services/common/geometry/ply_format.h"

namespace forgescan {
namespace {

Error Truncated(std::string_view name, std::string_view element, std::size_t row, std::size_t count) {
  return Fail(ErrorCode::kFormat,
              "{}: {} {} of {} is cut off, has more columns than the header, or holds what is not a number",
              name, element, row + 1, count);
}

Status CheckEnd(const ScalarCursor& cursor, std::string_view name) {
  if (cursor.AtEnd()) return {};
  return Fail(ErrorCode::kFormat, "{}: {} bytes follow the last row that the header announces", name,
              cursor.remaining_bytes());
}

Error Twice(std::string_view name, std::string_view property) {
  return Fail(ErrorCode::kFormat, "{}: the header gives the column of {} twice", name, property);
}

// Calls use(property index, value) for every scalar of a row; a list calls it for each of its entries. False:
// the row is not what the header says.
template <typename Use>
bool ReadPlyRow(const PlyElement& element, ScalarCursor& cursor, Use use) {
  cursor.BeginRow();
  for (std::size_t p = 0; p < element.properties.size(); ++p) {
    const PlyProperty& property = element.properties[p];
    double entries = 1;
    if (property.is_list) {
      const auto count = cursor.Next(property.count_type);
      if (!count || !(*count >= 0) || *count != std::floor(*count)) {
        return false;
      }
      entries = *count;
    }
    for (double i = 0; i < entries; ++i) {
      const auto value = cursor.Next(property.type);
      if (!value) {
        return false;
      }
      use(p, *value);
    }
  }
  return cursor.EndRow();
}

Status SkipPlyElement(const PlyElement& element, ScalarCursor& cursor, std::string_view name) {
  if (element.properties.empty() && element.count > 0) {
    return Fail(ErrorCode::kFormat, "{}: element {} of the PLY header has no properties", name, element.name);
  }
  for (std::size_t row = 0; row < element.count; ++row) {
    if (!ReadPlyRow(element, cursor, [](std::size_t, double) {})) {
      return Truncated(name, element.name, row, element.count);
    }
  }
  return {};
}

Result<CloudFromFile> ReadPlyVertices(const PlyElement& element, ScalarCursor& cursor,
                                      std::string_view name) {
  CloudBuilder builder;
  std::vector<int> columns;
  for (const auto& property : element.properties) {
    columns.push_back(property.is_list ? -1 : FindColumn(property.name));
    if (!builder.Expect(columns.back())) return Twice(name, property.name);
  }
  if (!builder.has_points()) {
    return Fail(ErrorCode::kFormat, "{}: its vertices have no x, y and z", name);
  }
  for (std::size_t row = 0; row < element.count; ++row) {
    if (!ReadPlyRow(element, cursor, [&](std::size_t p, double value) { builder.Set(columns[p], value); })) {
      return Truncated(name, "vertex", row, element.count);
    }
    RETURN_IF_ERROR(builder.FinishRow(name));
  }
  return std::move(builder).Finish();
}

Result<CloudFromFile> ParsePly(std::string_view bytes, std::string_view name) {
  ASSIGN_OR_RETURN(const PlyHeader header, ParsePlyHeader(bytes, name));
  ScalarCursor cursor(bytes.substr(header.body_offset), header.encoding);
  std::optional<CloudFromFile> cloud;
  for (const auto& element : header.elements) {
    if (element.name == "vertex") {
      ASSIGN_OR_RETURN(cloud, ReadPlyVertices(element, cursor, name));
    } else {
      RETURN_IF_ERROR(SkipPlyElement(element, cursor, name));
    }
  }
  if (!cloud) {
    return Fail(ErrorCode::kFormat, "{}: the PLY file has no vertex element", name);
  }
  RETURN_IF_ERROR(CheckEnd(cursor, name));
  return *std::move(cloud);
}

// The column of the cloud that a field fills, or -1.
int ColumnOf(const PcdField& field) { return field.count == 1 ? FindColumn(field.name) : -1; }

bool ReadPcdRow(const PcdHeader& header, ScalarCursor& cursor, CloudBuilder& builder) {
  cursor.BeginRow();
  for (const auto& field : header.fields) {
    for (std::size_t i = 0; i < field.count; ++i) {
      const auto value = cursor.Next(field.type);
      if (!value) return false;
      builder.Set(ColumnOf(field), *value);
    }
  }
  return cursor.EndRow();
}

Result<CloudFromFile> ParsePcd(std::string_view bytes, std::string_view name) {
  ASSIGN_OR_RETURN(const PcdHeader header, ParsePcdHeader(bytes, name));
  CloudBuilder builder;
  for (const auto& field : header.fields) {
    if (!builder.Expect(ColumnOf(field))) return Twice(name, field.name);
  }
  if (!builder.has_points()) {
    return Fail(ErrorCode::kFormat, "{}: its points have no x, y and z", name);
  }
  ScalarCursor cursor(bytes.substr(header.body_offset), header.encoding);
  for (std::size_t row = 0; row < header.points; ++row) {
    if (!ReadPcdRow(header, cursor, builder)) return Truncated(name, "point", row, header.points);
    RETURN_IF_ERROR(builder.FinishRow(name));
  }
  RETURN_IF_ERROR(CheckEnd(cursor, name));
  return std::move(builder).Finish();
}

Status AddFan(const std::vector<double>& polygon, std::string_view name, TriangleMesh& mesh) {
  if (polygon.size() < 3) {
    return Fail(ErrorCode::kFormat, "{}: a face has {} corners, at least 3 are needed", name, polygon.size());
  }
  for (const double index : polygon) {
    if (index != std::floor(index)) {
      return Fail(ErrorCode::kFormat, "{}: a face names vertex {}, which is not a whole number", name, index);
    }
    if (!(index >= 0 && index < static_cast<double>(mesh.vertices.size()))) {
      return Fail(ErrorCode::kFormat, "{}: a face names vertex {}, allowed 0..{}", name, index,
                  static_cast<double>(mesh.vertices.size()) - 1);
    }
  }
  for (std::size_t i = 2; i < polygon.size(); ++i) {
    mesh.triangles.push_back({static_cast<std::uint32_t>(polygon[0]),
                              static_cast<std::uint32_t>(polygon[i - 1]),
                              static_cast<std::uint32_t>(polygon[i])});
  }
  return {};
}

Status ReadPlyFaces(const PlyElement& element, ScalarCursor& cursor, std::string_view name,
                    TriangleMesh& mesh) {
  const int list = std::max(element.Find("vertex_indices"), element.Find("vertex_index"));
  if (list < 0) {
    return Fail(ErrorCode::kFormat, "{}: its faces have no vertex_indices list", name);
  }
  std::vector<double> polygon;
  for (std::size_t row = 0; row < element.count; ++row) {
    polygon.clear();
    const bool complete = ReadPlyRow(element, cursor, [&](std::size_t p, double value) {
      if (p == static_cast<std::size_t>(list)) {
        polygon.push_back(value);
      }
    });
    if (!complete) {
      return Truncated(name, "face", row, element.count);
    }
    RETURN_IF_ERROR(AddFan(polygon, name, mesh));
  }
  return {};
}

}  // namespace

Result<CloudFromFile> ParsePointCloud(std::string_view bytes, std::string_view name) {
  if (bytes.starts_with("ply")) {
    return ParsePly(bytes, name);
  }
  if (bytes.starts_with("# .PCD") || bytes.starts_with("VERSION")) {
    return ParsePcd(bytes, name);
  }
  return Fail(ErrorCode::kFormat, "{}: is neither a PLY nor a PCD file", name);
}

Result<TriangleMesh> ParseTriangleMesh(std::string_view bytes, std::string_view name) {
  if (!bytes.starts_with("ply")) {
    return Fail(ErrorCode::kFormat, "{}: is not a PLY file", name);
  }
  ASSIGN_OR_RETURN(const PlyHeader header, ParsePlyHeader(bytes, name));
  ScalarCursor cursor(bytes.substr(header.body_offset), header.encoding);
  TriangleMesh mesh;
  for (const auto& element : header.elements) {
    if (element.name == "vertex") {
      ASSIGN_OR_RETURN(auto cloud, ReadPlyVertices(element, cursor, name));
      if (cloud.size() != element.count) {
        return Fail(ErrorCode::kFormat, "{}: {} of {} vertices are not finite", name,
                    element.count - cloud.size(), element.count);
      }
      mesh.vertices = std::move(cloud.points);
    } else if (element.name == "face") {
      RETURN_IF_ERROR(ReadPlyFaces(element, cursor, name, mesh));
    } else {
      RETURN_IF_ERROR(SkipPlyElement(element, cursor, name));
    }
  }
  RETURN_IF_ERROR(CheckEnd(cursor, name));
  if (mesh.triangles.empty()) {
    return Fail(ErrorCode::kFormat, "{}: has no faces", name);
  }
  return mesh;
}

}  // namespace forgescan
