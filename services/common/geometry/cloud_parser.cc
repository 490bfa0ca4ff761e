#include <array>
#include <cmath>
#include <limits>
#include <utility>

#include "services/common/geometry/cloud_io.h"
#include "services/common/geometry/pcd_format.h"
#include "services/common/geometry/ply_format.h"

namespace forgescan {
namespace {

// What a cloud takes from a vertex, in this order.
enum Column { kX, kY, kZ, kNormalX, kNormalY, kNormalZ, kSigma, kView, kColumns };
constexpr std::array<std::pair<std::string_view, Column>, 11> kColumnNames = {{{"x", kX},
                                                                               {"y", kY},
                                                                               {"z", kZ},
                                                                               {"nx", kNormalX},
                                                                               {"ny", kNormalY},
                                                                               {"nz", kNormalZ},
                                                                               {"normal_x", kNormalX},
                                                                               {"normal_y", kNormalY},
                                                                               {"normal_z", kNormalZ},
                                                                               {"sigma_mm", kSigma},
                                                                               {"view", kView}}};

int FindColumn(std::string_view property) {
  for (const auto& [name, column] : kColumnNames) {
    if (name == property) {
      return column;
    }
  }
  return -1;
}

// Collects vertices row by row into a cloud; knows from the header which columns come.
class CloudBuilder {
 public:
  void Expect(int column) {
    if (column >= 0) {
      has_[static_cast<std::size_t>(column)] = true;
    }
  }
  bool has_points() const { return has_[kX] && has_[kY] && has_[kZ]; }

  void Set(int column, double value) {
    if (column >= 0) {
      row_[static_cast<std::size_t>(column)] = value;
    }
  }
  bool row_is_finite() const {
    return std::isfinite(row_[kX]) && std::isfinite(row_[kY]) && std::isfinite(row_[kZ]);
  }

  void FinishRow() {
    if (!row_is_finite()) {
      return;
    }
    cloud_.points.push_back(At(kX));
    if (has_[kNormalX] && has_[kNormalY] && has_[kNormalZ]) {
      cloud_.normals.push_back(At(kNormalX));
    }
    if (has_[kSigma]) {
      cloud_.sigma_mm.push_back(static_cast<float>(row_[kSigma]));
    }
    if (has_[kView]) {
      constexpr double kMaxView = std::numeric_limits<std::uint16_t>::max();
      const bool in_range = row_[kView] >= 0 && row_[kView] <= kMaxView;
      view_is_valid_ = view_is_valid_ && in_range;
      cloud_.view.push_back(in_range ? static_cast<std::uint16_t>(row_[kView]) : std::uint16_t{0});
    }
  }

  Result<PointCloud> Finish(std::string_view name) && {
    if (!view_is_valid_) {
      return Fail(ErrorCode::kFormat, "{}: a view index is outside 0..65535", name);
    }
    return std::move(cloud_);
  }

 private:
  Eigen::Vector3f At(std::size_t first) const {
    return Eigen::Vector3d(row_[first], row_[first + 1], row_[first + 2]).cast<float>();
  }

  std::array<bool, kColumns> has_{};
  std::array<double, kColumns> row_{};
  PointCloud cloud_;
  bool view_is_valid_ = true;
};

Error Truncated(std::string_view name, std::string_view element, std::size_t row, std::size_t count) {
  return Fail(ErrorCode::kFormat, "{}: {} {} of {} is cut off or not a number", name, element, row + 1,
              count);
}

// Calls use(property index, value) for every scalar of a row; a list calls it for each of its entries.
template <typename Use>
bool ReadPlyRow(const PlyElement& element, ScalarCursor& cursor, Use use) {
  for (std::size_t p = 0; p < element.properties.size(); ++p) {
    const PlyProperty& property = element.properties[p];
    double entries = 1;
    if (property.is_list) {
      const auto count = cursor.Next(property.count_type);
      if (!count || !(*count >= 0)) {
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
  return true;
}

Status SkipPlyElement(const PlyElement& element, ScalarCursor& cursor, std::string_view name) {
  for (std::size_t row = 0; row < element.count && !element.properties.empty(); ++row) {
    if (!ReadPlyRow(element, cursor, [](std::size_t, double) {})) {
      return Truncated(name, element.name, row, element.count);
    }
  }
  return {};
}

Result<PointCloud> ReadPlyVertices(const PlyElement& element, ScalarCursor& cursor, std::string_view name) {
  CloudBuilder builder;
  std::vector<int> columns;
  for (const auto& property : element.properties) {
    columns.push_back(property.is_list ? -1 : FindColumn(property.name));
    builder.Expect(columns.back());
  }
  if (!builder.has_points()) {
    return Fail(ErrorCode::kFormat, "{}: its vertices have no x, y and z", name);
  }
  for (std::size_t row = 0; row < element.count; ++row) {
    if (!ReadPlyRow(element, cursor, [&](std::size_t p, double value) { builder.Set(columns[p], value); })) {
      return Truncated(name, "vertex", row, element.count);
    }
    builder.FinishRow();
  }
  return std::move(builder).Finish(name);
}

Result<PointCloud> ParsePly(std::string_view bytes, std::string_view name) {
  ASSIGN_OR_RETURN(const PlyHeader header, ParsePlyHeader(bytes, name));
  ScalarCursor cursor(bytes.substr(header.body_offset), header.encoding);
  for (const auto& element : header.elements) {
    if (element.name == "vertex") {
      return ReadPlyVertices(element, cursor, name);
    }
    RETURN_IF_ERROR(SkipPlyElement(element, cursor, name));
  }
  return Fail(ErrorCode::kFormat, "{}: the PLY file has no vertex element", name);
}

Result<PointCloud> ParsePcd(std::string_view bytes, std::string_view name) {
  ASSIGN_OR_RETURN(const PcdHeader header, ParsePcdHeader(bytes, name));
  CloudBuilder builder;
  for (const auto& field : header.fields) {
    builder.Expect(field.count == 1 ? FindColumn(field.name) : -1);
  }
  if (!builder.has_points()) {
    return Fail(ErrorCode::kFormat, "{}: its points have no x, y and z", name);
  }
  ScalarCursor cursor(bytes.substr(header.body_offset), header.encoding);
  for (std::size_t row = 0; row < header.points; ++row) {
    for (const auto& field : header.fields) {
      const int column = field.count == 1 ? FindColumn(field.name) : -1;
      for (std::size_t i = 0; i < field.count; ++i) {
        const auto value = cursor.Next(field.type);
        if (!value) {
          return Truncated(name, "point", row, header.points);
        }
        builder.Set(column, *value);
      }
    }
    builder.FinishRow();
  }
  return std::move(builder).Finish(name);
}

Status AddFan(const std::vector<double>& polygon, std::string_view name, TriangleMesh& mesh) {
  for (const double index : polygon) {
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

Result<PointCloud> ParsePointCloud(std::string_view bytes, std::string_view name) {
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
  if (mesh.triangles.empty()) {
    return Fail(ErrorCode::kFormat, "{}: has no faces", name);
  }
  return mesh;
}

}  // namespace forgescan
