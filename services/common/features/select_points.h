// Which measured points belong to which face of the design model, and how far they are from it.
#pragma once

#include <cstdint>
#include <string>
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

// Points of the asked faces. Shape: points[i] belongs to faces[i]. Frames: model.
struct FacePoints {
  std::vector<std::uint32_t> faces;
  std::vector<std::vector<Eigen::Vector3d>> points;
};

// Errors: kInvalidArgument for a model that does not pass Check(), normals of another number than points.
Result<FacePoints> SelectFacePoints(const PointCloud& cloud_in_model, const ModelBundle& model,
                                    const std::vector<std::uint32_t>& faces, const SelectOptions& options);

// Signed distance of every point to the nearest model triangle, + outside; NaN where there is none within
// max_distance_mm. Units: mm. Frames: model. At a sharp edge the triangle that faces the point most decides
// the sign.
std::vector<float> SignedDeviations(const PointCloud& cloud_in_model, const TriangleIndex& surface,
                                    double max_distance_mm, unsigned threads);

}  // namespace forgescan
