// Measures parts against a design model bundle and a features file.
#pragma once

#include <memory>
#include <string>

#include "services/common/features/deviation_surface.h"
#include "services/common/features/dimensions.h"
#include "services/common/model/features.h"
#include "services/common/model/model_bundle.h"
#include "services/report/part_evaluator.h"

namespace forgescan {

class ModelEvaluator final : public PartEvaluator {
 public:
  // Errors: as ReadBundle, LoadFeatures and BindFeatures.
  static Result<std::unique_ptr<ModelEvaluator>> Load(const std::string& bundle_path,
                                                      const std::string& features_path,
                                                      const DimensionOptions& options);
  // Errors: as BindFeatures, DimensionEvaluator::Build and DeviationSurface::Build.
  static Result<std::unique_ptr<ModelEvaluator>> Make(ModelBundle model, Features features,
                                                      const DimensionOptions& options);

  std::vector<MeasuredDimension> Dimensions() const override;
  Result<std::vector<MeasuredDimension>> Evaluate(const PointCloud& cloud_in_model) const override;
  // NaN for a point further than kMaxDeviationMm from the model.
  Result<std::vector<float>> DeviationsMm(const PointCloud& cloud_in_model) const override;
  const std::vector<Eigen::Vector3f>& ModelPoints() const override {
    return dimensions_.model().sample_points;
  }

  static constexpr double kMaxDeviationMm = 20.0;

 private:
  ModelEvaluator(DimensionEvaluator dimensions, DeviationSurface surface);

  DimensionEvaluator dimensions_;
  DeviationSurface surface_;
};

}  // namespace forgescan
