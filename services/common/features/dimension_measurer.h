// One dimension from the fitted faces of a part.
#pragma once

#include <span>
#include <string>

#include "services/common/features/face_fits.h"
#include "services/common/features/influence.h"
#include "services/common/model/features.h"

namespace forgescan {

// A value with what it was made of; an Error instead becomes the reason of the result.
struct DimensionMeasurement {
  double value_mm = 0;
  double uncertainty_mm = 0;
  std::string definition;
  std::string remark;
  std::size_t points = 0, rejected = 0;  // summed over the faces
  double range_mm = 0, d95_mm = 0;
  Influence influence;
};

// Definitions: see DimensionEvaluator. `middles`: of the views, see InfluenceSum. Errors: those of the fits;
// kDegenerate when the faces seen do not determine the size.
Result<DimensionMeasurement> MeasureDimension(const DimensionSpec& spec, const FaceFits& fits,
                                              std::span<const Eigen::Vector3d> middles,
                                              const DimensionOptions& options);

}  // namespace forgescan
