// The key dimensions of a registered part: total length, widths and diameters between fitted faces.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "services/common/features/robust_fit.h"
#include "services/common/features/select_points.h"
#include "services/common/geometry/point_cloud.h"
#include "services/common/model/features.h"
#include "services/common/result.h"

namespace forgescan {

struct DimensionOptions {
  SelectOptions select;
  RobustOptions fit;
  std::size_t min_points = 50;       // on each face
  double min_arc_deg = 150;          // of a cylinder, for its diameter
  double max_angle_rad = 0.0087;     // 0.5 degrees, between the two faces of a width
  double flag_removed_share = 0.05;  // of the points; above, the dimension is marked
};

// Units: mm, at the temperature the points were measured at (the hot size).
struct DimensionResult {
  std::string name;
  DimensionType type = DimensionType::kLength;
  double nominal_mm = 0;
  std::optional<double> measured_mm;  // nothing: INDETERMINATE, and reason says why
  double standard_uncertainty_mm =
      0;                     // of the fits alone, as if the points were independent; 0 without measured_mm
  std::size_t points = 0;    // used, over all faces
  double removed_share = 0;  // rejected / selected
  std::string reason;        // why it could not be determined, or what to watch; empty if all is well
};

// Purpose: one result for each dimension, in the order of the features; a dimension that cannot be determined
// is a result too. Definitions: length = along the datum axis (line through the fitted axis points of the
// datum cylinders; with one cylinder its axis) between the least-squares planes of the faces, where the axis
// meets them. Width = mean distance of face 2's points from the least-squares plane of face 1. Diameter =
// twice the radius of the least-squares cylinder (ISO 14405-1: GG). Frames: cloud and model in the model
// frame. `features` have passed BindFeatures(). Errors: those of SelectFacePoints() and FindFace().
Result<std::vector<DimensionResult>> EvaluateDimensions(const PointCloud& cloud_in_model,
                                                        const ModelBundle& model, const Features& features,
                                                        const DimensionOptions& options);

}  // namespace forgescan
