#include "services/common/features/dimensions.h"

#include <set>

#include "services/common/features/dimension_measurer.h"

namespace forgescan {
namespace {

constexpr std::size_t kIdealPoints = 4096;  // a face; a cover finer than the form's cells says no more

DimensionResult Describe(const DimensionSpec& spec, const Result<DimensionMeasurement>& measured,
                         double flag_removed_share) {
  DimensionResult result;
  result.name = spec.name;
  result.type = spec.type;
  result.nominal_mm = spec.nominal_mm;
  if (!measured.ok()) {
    result.reason = measured.error().message;
    return result;
  }
  result.definition = measured->definition;
  result.measured_mm = measured->value_mm;
  result.standard_uncertainty_mm = measured->uncertainty_mm;
  result.influence = measured->influence;
  result.form_range_mm = measured->range_mm;
  result.form_d95_mm = measured->d95_mm;
  result.points = measured->points;
  const auto total = static_cast<double>(measured->points + measured->rejected);
  result.removed_share = total > 0 ? static_cast<double>(measured->rejected) / total : 0;
  result.reason = measured->remark;
  if (result.reason.empty() && result.removed_share > flag_removed_share) {
    result.reason =
        fmt::format("{:.1f} % of the points were rejected as outliers", 100 * result.removed_share);
  }
  return result;
}

Result<std::vector<std::uint32_t>> NamedFaces(const ModelBundle& model, const Features& features) {
  std::set<std::uint32_t> named;
  for (const DimensionSpec& spec : features.dimensions) {
    for (const auto* names : {&spec.faces, &spec.datum}) {
      for (const std::string& name : *names) {
        ASSIGN_OR_RETURN(const std::uint32_t face, FindFace(model, name));
        named.insert(face);
      }
    }
  }
  return std::vector<std::uint32_t>(named.begin(), named.end());
}

}  // namespace

DimensionEvaluator::DimensionEvaluator(std::unique_ptr<const ModelBundle> model, Features features,
                                       FaceSelector selector, const DimensionOptions& options)
    : model_(std::move(model)),
      features_(std::move(features)),
      selector_(std::move(selector)),
      options_(options) {}

Result<DimensionEvaluator> DimensionEvaluator::Build(ModelBundle model, Features features,
                                                     const DimensionOptions& options) {
  ASSIGN_OR_RETURN(const std::vector<std::uint32_t> faces, NamedFaces(model, features));
  ASSIGN_OR_RETURN(FaceSelector selector, FaceSelector::Build(model, faces));
  PointCloud samples;
  samples.points = model.sample_points;
  samples.normals = model.sample_normals;
  ASSIGN_OR_RETURN(FacePoints ideal, selector.Select(samples, options.select));
  for (auto& points : ideal.points) points = EvenSample(points, kIdealPoints);
  DimensionEvaluator evaluator(std::make_unique<const ModelBundle>(std::move(model)), std::move(features),
                               std::move(selector), options);
  evaluator.ideal_ = std::move(ideal);
  return evaluator;
}

Result<std::vector<DimensionResult>> DimensionEvaluator::Evaluate(const PointCloud& cloud_in_model) const {
  ASSIGN_OR_RETURN(const FacePoints seen, selector_.Select(cloud_in_model, options_.select));
  const auto middles = ViewMiddles(cloud_in_model.points, cloud_in_model.view);
  const FaceFits fits(*model_, options_, seen, ideal_);
  std::vector<DimensionResult> results;
  for (const DimensionSpec& spec : features_.dimensions) {
    results.push_back(
        Describe(spec, MeasureDimension(spec, fits, middles, options_), options_.flag_removed_share));
  }
  return results;
}

Result<std::vector<DimensionResult>> EvaluateDimensions(const PointCloud& cloud_in_model,
                                                        const ModelBundle& model, const Features& features,
                                                        const DimensionOptions& options) {
  ASSIGN_OR_RETURN(const DimensionEvaluator evaluator, DimensionEvaluator::Build(model, features, options));
  return evaluator.Evaluate(cloud_in_model);
}

}  // namespace forgescan
