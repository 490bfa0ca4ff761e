#include "services/common/model/features.h"

#include <toml++/toml.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <initializer_list>
#include <set>

#include "services/common/config/toml_text.h"
#include "services/common/input_file.h"

namespace forgescan {
namespace {

constexpr std::array kTypeNames = {"length", "width", "diameter"};
constexpr std::array kDefinitionNames = {"GG", "LP max", "LP min", "LP mean"};
constexpr double kParallelCosine = -0.99996;  // nominal planes face away from each other to 0.5 degrees
constexpr double kSameCylinderMm =
    1e-3;  // radius, and axis offset, between the nominal cylinders of one diameter

// Where a value stands in the file, for errors: "features.toml: dimension 'total length'".
struct Place {
  std::string text;
};

Status OnlyKeys(const toml::table& table, std::initializer_list<std::string_view> allowed,
                const Place& place) {
  for (const auto& [key, value] : table) {
    if (std::find(allowed.begin(), allowed.end(), key.str()) == allowed.end()) {
      return Fail(ErrorCode::kFormat, "{}: unknown key '{}'", place.text, std::string_view(key.str()));
    }
  }
  return {};
}

Result<std::string> TakeText(const toml::table& table, const char* key, const Place& place) {
  const auto value = table[key].value<std::string>();
  if (value && !value->empty()) return *value;
  return Fail(ErrorCode::kFormat, "{}: '{}' must be a text that is not empty", place.text, key);
}

Result<double> TakeNumber(const toml::table& table, const char* key, const Place& place) {
  const auto value = table[key].value<double>();
  if (value && std::isfinite(*value)) return *value;
  return Fail(ErrorCode::kFormat, "{}: '{}' must be a finite number", place.text, key);
}

Result<std::vector<std::string>> TakeNames(const toml::table& table, const char* key, const Place& place) {
  const toml::array* array = table[key].as_array();
  std::vector<std::string> names;
  for (std::size_t i = 0; array != nullptr && i < array->size(); ++i) {
    names.push_back((*array)[i].value_or(std::string()));
  }
  if (names.empty() || std::find(names.begin(), names.end(), "") != names.end()) {
    return Fail(ErrorCode::kFormat, "{}: '{}' must be a list of face names", place.text, key);
  }
  return names;
}

Result<DimensionType> TakeType(const toml::table& table, const Place& place) {
  ASSIGN_OR_RETURN(const std::string text, TakeText(table, "type", place));
  const auto it = std::find(kTypeNames.begin(), kTypeNames.end(), text);
  if (it != kTypeNames.end()) return static_cast<DimensionType>(it - kTypeNames.begin());
  return Fail(ErrorCode::kFormat, "{}: type '{}', allowed are length, width, diameter", place.text, text);
}

Status TakeDefinition(const toml::table& table, const Place& place, DimensionSpec& spec) {
  if (table.contains("definition")) {
    ASSIGN_OR_RETURN(const std::string text, TakeText(table, "definition", place));
    const auto it = std::find(kDefinitionNames.begin(), kDefinitionNames.end(), text);
    if (it == kDefinitionNames.end() || spec.type != DimensionType::kDiameter) {
      return Fail(ErrorCode::kFormat,
                  "{}: definition '{}', allowed for a diameter are GG, LP max, LP min, LP mean", place.text,
                  text);
    }
    spec.definition = static_cast<SizeDefinition>(it - kDefinitionNames.begin());
  }
  const toml::array* sections = table["sections_mm"].as_array();
  for (std::size_t i = 0; sections != nullptr && i < sections->size(); ++i) {
    spec.sections_mm.push_back((*sections)[i].value_or(std::nan("")));
    if (!std::isfinite(spec.sections_mm.back())) sections = nullptr, spec.sections_mm.clear();
  }
  const bool two_point = spec.definition != SizeDefinition::kLeastSquares;
  if (two_point != table.contains("sections_mm") || two_point == spec.sections_mm.empty()) {
    return Fail(ErrorCode::kFormat,
                "{}: 'sections_mm', a list of numbers, is needed for an LP size and for nothing else",
                place.text);
  }
  return {};
}

Status CheckDimension(const DimensionSpec& spec, const Place& place) {
  if (!(spec.lower_mm > 0 && spec.upper_mm > spec.lower_mm)) {
    return Fail(ErrorCode::kFormat, "{}: limits {} to {} mm, expected 0 < lower_mm < upper_mm", place.text,
                spec.lower_mm, spec.upper_mm);
  }
  if (spec.expanded_uncertainty_mm && !(*spec.expanded_uncertainty_mm >= 0)) {
    return Fail(ErrorCode::kFormat, "{}: expanded_uncertainty_mm is {}, expected >= 0", place.text,
                *spec.expanded_uncertainty_mm);
  }
  if (spec.type != DimensionType::kDiameter && spec.faces.size() != 2) {
    return Fail(ErrorCode::kFormat, "{}: {} faces, a {} is between exactly 2", place.text, spec.faces.size(),
                DimensionTypeName(spec.type));
  }
  if ((spec.type == DimensionType::kLength) == spec.datum.empty()) {
    return Fail(ErrorCode::kFormat, "{}: 'datum' is needed for a length and for nothing else", place.text);
  }
  return {};
}

Result<DimensionSpec> TakeDimension(const toml::table& table, const std::string& file) {
  DimensionSpec spec;
  ASSIGN_OR_RETURN(spec.name, TakeText(table, "name", {file + ": a dimension"}));
  const Place place{fmt::format("{}: dimension '{}'", file, spec.name)};
  RETURN_IF_ERROR(OnlyKeys(table,
                           {"name", "type", "faces", "datum", "definition", "sections_mm", "lower_mm",
                            "upper_mm", "expanded_uncertainty_mm"},
                           place));
  ASSIGN_OR_RETURN(spec.type, TakeType(table, place));
  ASSIGN_OR_RETURN(spec.faces, TakeNames(table, "faces", place));
  if (table.contains("datum")) {
    ASSIGN_OR_RETURN(spec.datum, TakeNames(table, "datum", place));
  }
  RETURN_IF_ERROR(TakeDefinition(table, place, spec));
  ASSIGN_OR_RETURN(spec.lower_mm, TakeNumber(table, "lower_mm", place));
  ASSIGN_OR_RETURN(spec.upper_mm, TakeNumber(table, "upper_mm", place));
  if (table.contains("expanded_uncertainty_mm")) {
    ASSIGN_OR_RETURN(spec.expanded_uncertainty_mm, TakeNumber(table, "expanded_uncertainty_mm", place));
  }
  RETURN_IF_ERROR(CheckDimension(spec, place));
  return spec;
}

Result<Features> TakeFeatures(const toml::table& table, const std::string& file) {
  const Place place{file};
  RETURN_IF_ERROR(OnlyKeys(table, {"part", "reference_temperature_degc", "dimension"}, place));
  Features features;
  ASSIGN_OR_RETURN(features.part, TakeText(table, "part", place));
  ASSIGN_OR_RETURN(features.reference_temperature_degc,
                   TakeNumber(table, "reference_temperature_degc", place));
  if (features.reference_temperature_degc < -50 || features.reference_temperature_degc > 1500) {
    return Fail(ErrorCode::kFormat, "{}: reference_temperature_degc is {}, allowed -50 to 1500", file,
                features.reference_temperature_degc);
  }
  const toml::array* dimensions = table["dimension"].as_array();
  std::set<std::string> names;
  for (std::size_t i = 0; dimensions != nullptr && i < dimensions->size(); ++i) {
    const toml::table* one = (*dimensions)[i].as_table();
    if (one == nullptr)
      return Fail(ErrorCode::kFormat, "{}: 'dimension' must be tables: [[dimension]]", file);
    ASSIGN_OR_RETURN(DimensionSpec spec, TakeDimension(*one, file));
    if (!names.insert(spec.name).second) {
      return Fail(ErrorCode::kFormat, "{}: two dimensions are called '{}'", file, spec.name);
    }
    features.dimensions.push_back(std::move(spec));
  }
  if (features.dimensions.empty()) return Fail(ErrorCode::kFormat, "{}: no [[dimension]]", file);
  return features;
}

Result<std::vector<const ModelFace*>> FacesOfType(const ModelBundle& model,
                                                  const std::vector<std::string>& names, FaceType type) {
  std::vector<const ModelFace*> faces;
  for (const std::string& name : names) {
    ASSIGN_OR_RETURN(const std::uint32_t i, FindFace(model, name));
    faces.push_back(&model.faces[i]);
    if (faces.back()->type == type) continue;
    return Fail(ErrorCode::kInvalidArgument, "face '{}' is a {}, a {} is needed", name,
                FaceTypeName(faces.back()->type), FaceTypeName(type));
  }
  return faces;
}

Result<double> NominalWidth(const DimensionSpec& spec, const ModelBundle& model) {
  ASSIGN_OR_RETURN(const auto planes, FacesOfType(model, spec.faces, FaceType::kPlane));
  if (planes[0]->direction.dot(planes[1]->direction) > kParallelCosine) {
    return Fail(ErrorCode::kInvalidArgument, "faces '{}' and '{}' do not face away from each other",
                planes[0]->name, planes[1]->name);
  }
  return (planes[0]->point - planes[1]->point).dot(planes[0]->direction);
}

Result<double> NominalLength(const DimensionSpec& spec, const ModelBundle& model) {
  ASSIGN_OR_RETURN(const double between_planes, NominalWidth(spec, model));
  ASSIGN_OR_RETURN(const auto cylinders, FacesOfType(model, spec.datum, FaceType::kCylinder));
  ASSIGN_OR_RETURN(const auto planes, FacesOfType(model, spec.faces, FaceType::kPlane));
  const double cosine = std::abs(cylinders[0]->direction.dot(planes[0]->direction));
  if (cosine < 0.9) {
    return Fail(ErrorCode::kInvalidArgument, "the axis of '{}' does not run from face '{}' to face '{}'",
                cylinders[0]->name, planes[0]->name, planes[1]->name);
  }
  return between_planes / cosine;
}

Result<double> NominalDiameter(const DimensionSpec& spec, const ModelBundle& model) {
  ASSIGN_OR_RETURN(const auto cylinders, FacesOfType(model, spec.faces, FaceType::kCylinder));
  const ModelFace& first = *cylinders.front();
  for (const ModelFace* other : cylinders) {
    const double offset_mm = (other->point - first.point).cross(first.direction).norm();
    if (std::abs(other->radius_mm - first.radius_mm) < kSameCylinderMm && offset_mm < kSameCylinderMm)
      continue;
    return Fail(ErrorCode::kInvalidArgument, "faces '{}' and '{}' are not of one cylinder", first.name,
                other->name);
  }
  return 2 * first.radius_mm;
}

Result<double> Nominal(const DimensionSpec& spec, const ModelBundle& model) {
  switch (spec.type) {
    case DimensionType::kLength:
      return NominalLength(spec, model);
    case DimensionType::kWidth:
      return NominalWidth(spec, model);
    case DimensionType::kDiameter:
      return NominalDiameter(spec, model);
  }
  return Fail(ErrorCode::kInvalidArgument, "unknown type of dimension");
}

}  // namespace

const char* SizeDefinitionName(SizeDefinition definition) {
  return kDefinitionNames[static_cast<std::size_t>(definition)];
}

const char* DimensionTypeName(DimensionType type) { return kTypeNames[static_cast<std::size_t>(type)]; }

Result<Features> ParseFeatures(std::string_view text, std::string_view name) {
  RETURN_IF_ERROR(CheckTomlText(text, name));
  try {
    return TakeFeatures(toml::parse(text), std::string(name));
  } catch (const toml::parse_error& error) {
    return Fail(ErrorCode::kFormat, "{}: line {}: {}", name, error.source().begin.line, error.description());
  }
}

Result<Features> LoadFeatures(const std::filesystem::path& path) {
  ASSIGN_OR_RETURN(const std::string text, ReadInputFile(path));
  return ParseFeatures(text, path.string());
}

Result<Features> BindFeatures(Features features, const ModelBundle& model) {
  for (DimensionSpec& spec : features.dimensions) {
    auto nominal = Nominal(spec, model);
    if (!nominal.ok()) {
      return Fail(nominal.error().code, "dimension '{}': {}", spec.name, nominal.error().message);
    }
    spec.nominal_mm = *nominal;
  }
  return features;
}

}  // namespace forgescan
