// The design model, prepared once for registration and measurement: its surface as triangles, the faces of
// the CAD model as nominal features, and evenly spread samples for nearest-neighbour search.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <string>
#include <vector>

#include "services/common/geometry/surface_grid.h"
#include "services/common/geometry/triangle_index.h"
#include "services/common/result.h"

namespace forgescan {

enum class FaceType : std::uint32_t { kFreeform = 0, kPlane, kCylinder, kCone, kSphere, kTorus };
constexpr std::uint32_t kLastFaceType = static_cast<std::uint32_t>(FaceType::kTorus);

// "plane", "cylinder", ...
const char* FaceTypeName(FaceType type);

// One face of the CAD model = one nominal feature. Units: mm. Frames: model.
struct ModelFace {
  std::string name;  // unique within the model; from the file, else <type>_<number>
  FaceType type = FaceType::kFreeform;
  Eigen::Vector3d point =
      Eigen::Vector3d::Zero();  // plane: on it; cylinder, cone, torus: on the axis; sphere: centre
  Eigen::Vector3d direction =
      Eigen::Vector3d::Zero();       // plane: unit outward normal; cylinder, cone, torus: unit axis
  double radius_mm = 0;              // cylinder, sphere; torus: of the tube's centre line; else 0
  std::uint32_t first_triangle = 0;  // a face's triangles are consecutive
  std::uint32_t triangle_count = 0;
};

// Shape: sample_* have one entry per sample. Units: mm. Frames: model.
struct ModelBundle {
  std::vector<Eigen::Vector3f> vertices;
  std::vector<TriangleCorners> triangles;  // ordered by face; corners counter-clockwise seen from outside
  std::vector<ModelFace> faces;
  std::vector<Eigen::Vector3f> sample_points;  // about one per spacing_mm^2 of surface
  std::vector<Eigen::Vector3f> sample_normals;
  double spacing_mm = 0;
  double resolution_mm = 0;  // r of Eq. (10): mean distance of a sample to its nearest other sample
  double chord_error_mm =
      0;  // largest distance between triangles and CAD surface asked for; 0: the file was triangles
  SurfaceGrid grid;  // of the triangles; in a bundle read from a file, its arrays are the mapped file
  std::uint32_t checksum = 0;  // CRC-32 of everything above as written to a bundle file
};

// Errors: kInvalidArgument naming the first member that breaks the description above (counts, ranges, not
// finite).
Status Check(const ModelBundle& bundle);

// Entry i: index into bundle.faces of the face that owns triangle i. The bundle has passed Check().
std::vector<std::uint32_t> FaceOfTriangles(const ModelBundle& bundle);

// Errors: kNotFound, listing the names there are (the first 20).
Result<std::uint32_t> FindFace(const ModelBundle& bundle, const std::string& name);

}  // namespace forgescan
