// Which measured points belong to which face of the design model, and how far they are from it.
#pragma once

#include <cstdint>
#include <optional>
#include <utility>
#include <vector>

#include "services/common/geometry/point_cloud.h"
#include "services/common/geometry/triangle_index.h"
#include "services/common/model/model_bundle.h"
#include "services/common/result.h"

namespace forgescan {

struct SelectOptions {
  double max_distance_mm = 3;  // to the design surface
  double normal_limit_rad =
      0.52;              // 30 degrees, between measured and nominal normal; used where the cloud has normals
  double border_mm = 2;  // the foot point stays this far inside its face: fillets belong to nobody
  unsigned threads = 0;  // 0: as many as the host has; the result does not depend on it
};

// Points of the asked faces. Shape: points[i] belongs to faces[i]; views has as many entries, or none for a
// cloud without. Frames: model.
struct FacePoints {
  std::vector<std::uint32_t> faces;
  std::vector<std::vector<Eigen::Vector3d>> points;
  std::vector<std::vector<std::uint16_t>> views;
};

// Made once for a model and the faces that are asked for.
class FaceSelector {
 public:
  // Errors: kInvalidArgument for a model that does not pass Check(), or a face it does not have.
  static Result<FaceSelector> Build(const ModelBundle& model, const std::vector<std::uint32_t>& faces);

  // Errors: kInvalidArgument for normals or views of another number than points.
  Result<FacePoints> Select(const PointCloud& cloud_in_model, const SelectOptions& options) const;

 private:
  FaceSelector(TriangleIndex surface, std::vector<std::uint32_t> faces)
      : surface_(std::move(surface)), faces_(std::move(faces)) {}
  std::uint32_t SlotOf(const PointCloud& cloud, std::size_t i, const SelectOptions& options,
                       std::uint32_t& hint) const;

  TriangleIndex surface_;
  std::vector<std::uint32_t> faces_;
  std::vector<std::optional<TriangleIndex>> borders_;  // one per asked face
  std::vector<std::uint32_t> slot_of_triangle_;
};

}  // namespace forgescan
