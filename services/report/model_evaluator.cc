#include "services/report/model_evaluator.h"

#include <thread>

#include "services/common/model/bundle_file.h"

namespace forgescan {

ModelEvaluator::ModelEvaluator(DimensionEvaluator dimensions, DeviationSurface surface)
    : dimensions_(std::move(dimensions)), surface_(std::move(surface)) {}

Result<std::unique_ptr<ModelEvaluator>> ModelEvaluator::Load(const std::string& bundle_path,
                                                             const std::string& features_path,
                                                             const DimensionOptions& options) {
  ASSIGN_OR_RETURN(ModelBundle model, ReadBundle(bundle_path));
  ASSIGN_OR_RETURN(Features features, LoadFeatures(features_path));
  return Make(std::move(model), std::move(features), options);
}

Result<std::unique_ptr<ModelEvaluator>> ModelEvaluator::Make(ModelBundle model, Features features,
                                                             const DimensionOptions& options) {
  ASSIGN_OR_RETURN(Features bound, BindFeatures(std::move(features), model));
  ASSIGN_OR_RETURN(DeviationSurface surface, DeviationSurface::Build(model.vertices, model.triangles));
  ASSIGN_OR_RETURN(DimensionEvaluator dimensions,
                   DimensionEvaluator::Build(std::move(model), std::move(bound), options));
  return std::unique_ptr<ModelEvaluator>(new ModelEvaluator(std::move(dimensions), std::move(surface)));
}

std::vector<MeasuredDimension> ModelEvaluator::Dimensions() const {
  std::vector<MeasuredDimension> dimensions;
  for (const DimensionSpec& spec : dimensions_.features().dimensions) {
    MeasuredDimension dimension;
    dimension.name = spec.name;
    dimension.nominal_mm = spec.nominal_mm;
    dimension.lower_mm = spec.lower_mm;
    dimension.upper_mm = spec.upper_mm;
    dimension.reference_degc = dimensions_.features().reference_temperature_degc;
    dimension.expanded_uncertainty_mm = spec.expanded_uncertainty_mm;
    dimensions.push_back(std::move(dimension));
  }
  return dimensions;
}

Result<std::vector<MeasuredDimension>> ModelEvaluator::Evaluate(const PointCloud& cloud_in_model) const {
  ASSIGN_OR_RETURN(const std::vector<DimensionResult> results, dimensions_.Evaluate(cloud_in_model));
  std::vector<MeasuredDimension> dimensions = Dimensions();
  if (results.size() != dimensions.size()) {
    return Fail(ErrorCode::kUntrusted, "{} of {} dimensions were evaluated", results.size(),
                dimensions.size());
  }
  for (std::size_t i = 0; i < results.size(); ++i) {
    dimensions[i].measured_mm = results[i].measured_mm;
    dimensions[i].definition = results[i].definition;
    dimensions[i].influence = results[i].influence;
    dimensions[i].fit_uncertainty_mm = results[i].standard_uncertainty_mm;
    dimensions[i].points = static_cast<int>(results[i].points);
    dimensions[i].rejected_share = results[i].removed_share;
    dimensions[i].reason = results[i].reason;
  }
  return dimensions;
}

Result<std::vector<float>> ModelEvaluator::DeviationsMm(const PointCloud& cloud_in_model) const {
  return SignedDeviations(cloud_in_model, surface_, kMaxDeviationMm, std::thread::hardware_concurrency());
}

}  // namespace forgescan
