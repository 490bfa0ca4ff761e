// What the report needs of the design model: sizes, deviations, and the list of what is to be measured.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "services/common/features/influence.h"
#include "services/common/geometry/point_cloud.h"
#include "services/common/result.h"

namespace forgescan {

// A dimension before the verdict: what the design asks, and what the points gave.
struct MeasuredDimension {
  std::string name;
  double nominal_mm = 0.0;
  double lower_mm = 0.0;
  double upper_mm = 0.0;
  double reference_degc = 0.0;                    // for which the limits hold
  std::optional<double> expanded_uncertainty_mm;  // stated in the features file, in place of the budget's
  std::optional<double> measured_mm;              // nothing when not determined; then `reason` says why
  std::string definition;                         // what was measured
  double fit_uncertainty_mm = 0.0;                // standard uncertainty from the fits; NaN when not known
  Influence influence;  // of errors of views, points and faces; empty when not known
  int points = 0;
  double rejected_share = 0.0;  // 0..1
  // Without a measured value: why. With one: what speaks against trusting it; the verdict is NOT_DECIDABLE.
  std::string reason;
};

class PartEvaluator {
 public:
  virtual ~PartEvaluator() = default;

  // Every dimension of the part, without measured values: for parts that could not be inspected.
  virtual std::vector<MeasuredDimension> Dimensions() const = 0;
  // The same dimensions in the same order, measured. Errors: when the cloud as a whole cannot be used.
  virtual Result<std::vector<MeasuredDimension>> Evaluate(const PointCloud& cloud_in_model) const = 0;
  // Signed distance of every point to the model's surface, + = outside. Shape: one a point. Units: mm.
  virtual Result<std::vector<float>> DeviationsMm(const PointCloud& cloud_in_model) const = 0;
  // Points all over the model's surface, to draw where no data are. Units: mm.
  virtual const std::vector<Eigen::Vector3f>& ModelPoints() const = 0;
};

}  // namespace forgescan
