// features.toml: which dimensions of the part are measured, between which faces, and their limits.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "services/common/model/model_bundle.h"
#include "services/common/result.h"

namespace forgescan {

enum class DimensionType { kLength, kWidth, kDiameter };

// "length", "width", "diameter"
const char* DimensionTypeName(DimensionType type);

// What a diameter is, by the modifiers of ISO 14405-1: of the least-squares cylinder (GG), or the largest,
// smallest or mean two-point size (LP with rank order) in given sections.
enum class SizeDefinition { kLeastSquares, kTwoPointMax, kTwoPointMin, kTwoPointMean };

// "GG", "LP max", "LP min", "LP mean"
const char* SizeDefinitionName(SizeDefinition definition);

// Units: mm, of the part at its reference temperature (the hot size).
struct DimensionSpec {
  std::string name;
  DimensionType type = DimensionType::kLength;
  std::vector<std::string> faces;  // length, width: two planes; diameter: cylinders of one axis and radius
  std::vector<std::string> datum;  // length only: the cylinders whose axis it is measured along
  SizeDefinition definition = SizeDefinition::kLeastSquares;  // of a diameter
  std::vector<double> sections_mm;  // LP only: along the nominal axis, from the face's nominal point
  double lower_mm = 0;              // limits of the size, absolute
  double upper_mm = 0;
  std::optional<double> expanded_uncertainty_mm;  // U at 95 %, where the station knows better than the fit
  double nominal_mm = 0;                          // computed from the model by BindFeatures()
};

struct Features {
  std::string part;
  double reference_temperature_degc = 0;
  std::vector<DimensionSpec> dimensions;
};

// Errors: kNotFound, kFormat naming file, dimension and key: missing, unknown, of the wrong type or out of
// range.
Result<Features> LoadFeatures(const std::filesystem::path& path);
Result<Features> ParseFeatures(std::string_view text, std::string_view name);

// Fills nominal_mm from the model's faces. Errors: kNotFound for a face the model does not have;
// kInvalidArgument for a face of the wrong type, planes that do not face away from each other, or cylinders
// that differ.
Result<Features> BindFeatures(Features features, const ModelBundle& model);

}  // namespace forgescan
