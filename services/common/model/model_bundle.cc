#include "services/common/model/model_bundle.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <set>

namespace forgescan {
namespace {

constexpr double kUnitTolerance =
    1e-3;  // a direction's length; float files keep 1e-7, hand-written ones fewer digits

Status CheckFace(const ModelBundle& bundle, std::size_t i, std::uint32_t expected_first) {
  const ModelFace& face = bundle.faces[i];
  if (face.first_triangle != expected_first) {
    return Fail(ErrorCode::kInvalidArgument, "face {} ('{}') starts at triangle {}, expected {}", i,
                face.name, face.first_triangle, expected_first);
  }
  if (!face.point.allFinite() || !face.direction.allFinite() || !(face.radius_mm >= 0) ||
      !std::isfinite(face.radius_mm)) {
    return Fail(ErrorCode::kInvalidArgument, "face {} ('{}') has parameters that are not finite", i,
                face.name);
  }
  const bool needs_direction = face.type == FaceType::kPlane || face.type == FaceType::kCylinder;
  if (needs_direction && std::abs(face.direction.norm() - 1) > kUnitTolerance) {
    return Fail(ErrorCode::kInvalidArgument, "face {} ('{}') has a direction of length {}, expected 1", i,
                face.name, face.direction.norm());
  }
  return {};
}

Status CheckFaces(const ModelBundle& bundle) {
  std::uint64_t next = 0;
  std::set<std::string> names;
  for (std::size_t i = 0; i < bundle.faces.size(); ++i) {
    RETURN_IF_ERROR(CheckFace(bundle, i, static_cast<std::uint32_t>(next)));
    if (!names.insert(bundle.faces[i].name).second) {
      return Fail(ErrorCode::kInvalidArgument, "face name '{}' occurs twice", bundle.faces[i].name);
    }
    next += bundle.faces[i].triangle_count;
  }
  if (next != bundle.triangles.size()) {
    return Fail(ErrorCode::kInvalidArgument, "the faces own {} triangles, the model has {}", next,
                bundle.triangles.size());
  }
  return {};
}

bool AllFinite(const std::vector<Eigen::Vector3f>& values) {
  return std::all_of(values.begin(), values.end(), [](const Eigen::Vector3f& v) { return v.allFinite(); });
}

}  // namespace

const char* FaceTypeName(FaceType type) {
  static constexpr std::array kNames = {"freeform", "plane", "cylinder", "cone", "sphere", "torus"};
  return kNames[static_cast<std::size_t>(type)];
}

Status Check(const ModelBundle& bundle) {
  if (bundle.triangles.empty() || bundle.sample_points.empty()) {
    return Fail(ErrorCode::kInvalidArgument,
                "the model has {} triangles and {} samples, at least 1 of each is needed",
                bundle.triangles.size(), bundle.sample_points.size());
  }
  if (bundle.sample_points.size() != bundle.sample_normals.size()) {
    return Fail(ErrorCode::kInvalidArgument, "the model has {} samples but {} sample normals",
                bundle.sample_points.size(), bundle.sample_normals.size());
  }
  if (!AllFinite(bundle.vertices) || !AllFinite(bundle.sample_points) || !AllFinite(bundle.sample_normals)) {
    return Fail(ErrorCode::kInvalidArgument, "the model has a vertex or sample that is not finite");
  }
  for (const TriangleCorners& t : bundle.triangles) {
    if (std::max({t[0], t[1], t[2]}) >= bundle.vertices.size()) {
      return Fail(ErrorCode::kInvalidArgument, "a model triangle names a vertex beyond the {} there are",
                  bundle.vertices.size());
    }
  }
  const bool finite = std::isfinite(bundle.spacing_mm) && std::isfinite(bundle.resolution_mm) &&
                      std::isfinite(bundle.chord_error_mm);
  if (!finite || !(bundle.spacing_mm > 0 && bundle.resolution_mm >= 0 && bundle.chord_error_mm >= 0)) {
    return Fail(
        ErrorCode::kInvalidArgument,
        "the model's spacing is {} mm, its resolution {} mm and its chord error {} mm, expected finite "
        "numbers > 0, >= 0 and >= 0",
        bundle.spacing_mm, bundle.resolution_mm, bundle.chord_error_mm);
  }
  RETURN_IF_ERROR(Check(bundle.grid.arrays(), bundle.triangles.size()));
  return CheckFaces(bundle);
}

std::vector<std::uint32_t> FaceOfTriangles(const ModelBundle& bundle) {
  std::vector<std::uint32_t> face_of(bundle.triangles.size());
  for (std::uint32_t i = 0; i < bundle.faces.size(); ++i) {
    const ModelFace& face = bundle.faces[i];
    std::fill_n(face_of.begin() + face.first_triangle, face.triangle_count, i);
  }
  return face_of;
}

Result<std::uint32_t> FindFace(const ModelBundle& bundle, const std::string& name) {
  std::string known;
  for (std::uint32_t i = 0; i < bundle.faces.size(); ++i) {
    if (bundle.faces[i].name == name) return i;
    if (i < 20) known += (i > 0 ? ", " : "") + bundle.faces[i].name;
  }
  return Fail(ErrorCode::kNotFound, "the model has no face '{}'; it has {}{}", name, known,
              bundle.faces.size() > 20 ? ", ..." : "");
}

}  // namespace forgescan
