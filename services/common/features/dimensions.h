// The key dimensions of a registered part: total length, widths and diameters between fitted faces.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "services/common/features/influence_sum.h"
#include "services/common/features/robust_fit.h"
#include "services/common/features/select_points.h"
#include "services/common/geometry/point_cloud.h"
#include "services/common/model/features.h"
#include "services/common/result.h"

namespace forgescan {

// What is done with a cylinder of which too short an arc is seen: no diameter, or one with the axis held at
// the nominal one, which says so.
enum class ShortArc { kRefuse, kHoldAxis };

struct DimensionOptions {
  SelectOptions select;
  RobustOptions fit;
  InfluenceOptions influence;
  std::size_t min_points = 50;  // on each face
  double min_arc_deg = 150;     // of a cylinder, for its diameter
  ShortArc short_arc = ShortArc::kRefuse;
  double max_angle_rad = 0.0087;     // 0.5 degrees, between the two faces of a width
  double flag_removed_share = 0.05;  // of the points; above, the dimension is marked
};

// Units: mm, at the temperature the points were measured at (the hot size).
struct DimensionResult {
  std::string name;
  DimensionType type = DimensionType::kLength;
  std::string definition;  // what was measured, in the words of ISO 14405-1 where it has them
  double nominal_mm = 0;
  std::optional<double> measured_mm;  // nothing: INDETERMINATE, and reason says why
  double standard_uncertainty_mm =
      0;                     // of the fits alone, as if the points were independent; 0 without measured_mm
  Influence influence;       // what errors of views, points and faces do to it; empty without measured_mm
  double form_range_mm = 0;  // largest range of residuals over its faces: an upper bound of their form error
  double form_d95_mm = 0;    // largest thickness over its faces of the shell that holds 95 % of the points
  std::size_t points = 0;    // used, over all faces
  double removed_share = 0;  // rejected / selected
  std::string reason;        // why it could not be determined, or what to watch; empty if all is well
};

// Purpose: one result for each dimension, in the order of the features; a dimension that cannot be determined
// is a result too. Definitions: length = along the datum axis (line through the fitted axis points of the
// datum cylinders; with one cylinder its axis) between the least-squares planes of the faces, where the axis
// meets them; an end that is not plane counts with the 99.5 % quantile of its points along the axis, and the
// result says so. Width = mean distance of face 2's points from the least-squares plane of face 1. Diameter =
// twice the radius of the least-squares cylinder (ISO 14405-1: GG).
class DimensionEvaluator {
 public:
  // Made once for a model. `features` have passed BindFeatures(). Errors: those of FaceSelector and
  // FindFace().
  static Result<DimensionEvaluator> Build(ModelBundle model, Features features,
                                          const DimensionOptions& options);

  // Frames: the cloud is in the model frame. Errors: those of FaceSelector::Select().
  Result<std::vector<DimensionResult>> Evaluate(const PointCloud& cloud_in_model) const;

  const ModelBundle& model() const { return *model_; }
  const Features& features() const { return features_; }

 private:
  DimensionEvaluator(std::unique_ptr<const ModelBundle> model, Features features, FaceSelector selector,
                     const DimensionOptions& options);

  std::unique_ptr<const ModelBundle> model_;
  Features features_;
  FaceSelector selector_;
  DimensionOptions options_;
  FacePoints ideal_;  // an even cover of the faces, from the model's own samples
};

// The same in one call, for a single cloud.
Result<std::vector<DimensionResult>> EvaluateDimensions(const PointCloud& cloud_in_model,
                                                        const ModelBundle& model, const Features& features,
                                                        const DimensionOptions& options);

}  // namespace forgescan
