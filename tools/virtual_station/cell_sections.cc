#include "tools/virtual_station/cell_sections.h"

#include <algorithm>
#include <cmath>

namespace forgescan {

TomlSection CellFile::Section(const std::string& name) const {
  return {root.get_as<toml::table>(name), fmt::format("{} [{}]", path, name)};
}

Result<std::vector<const toml::table*>> CellFile::Tables(const std::string& name) const {
  const toml::array* array = root.get_as<toml::array>(name);
  if (array == nullptr || array->empty() || !array->is_array_of_tables()) {
    return Fail(ErrorCode::kFormat, "{}: [[{}]] must be given at least once", path, name);
  }
  std::vector<const toml::table*> tables;
  for (const toml::node& node : *array) {
    tables.push_back(node.as_table());
  }
  return tables;
}

namespace {

// Errors: also kFormat for a size that is none of the axle's, or not one it can have.
Result<std::vector<OddPart>> ReadOddParts(const CellFile& file) {
  if (!file.root.contains("odd_part")) {
    return std::vector<OddPart>();
  }
  ASSIGN_OR_RETURN(const auto tables, file.Tables("odd_part"));
  std::vector<OddPart> parts;
  for (const toml::table* table : tables) {
    const std::string place = fmt::format("{} [[odd_part]] {}", file.path, parts.size());
    TomlSection s(table, place);
    OddPart part{s.Integer("part", {0, 1e6}), nullptr, 0.0};
    const std::string name = s.Text("dimension");
    part.mm = s.Number("size_mm", {0, 10000});
    RETURN_IF_ERROR(s.Finish());
    const auto found = std::find_if(kAxleDimensions.begin(), kAxleDimensions.end(),
                                    [&](const AxleDimension& dimension) { return name == dimension.name; });
    if (found == kAxleDimensions.end()) {
      return Fail(ErrorCode::kFormat, "{}: dimension '{}' is none of the axle", place, name);
    }
    part.size_mm = found->size_mm;
    AxleSize size;
    size.*part.size_mm = part.mm;
    if (const Status possible = Check(size); !possible.ok()) {
      return Fail(ErrorCode::kFormat, "{}: {}", place, possible.error().message);
    }
    parts.push_back(part);
  }
  return parts;
}

}  // namespace

Result<PartConfig> ReadPart(const CellFile& file) {
  TomlSection s = file.Section("part");
  PartConfig part{};
  part.nominal.total_length_mm = s.Number("total_length_mm", {1800, 1980});
  part.nominal.left_plate_width_mm = s.Number("left_plate_width_mm", {171, 187});
  part.nominal.right_plate_width_mm = s.Number("right_plate_width_mm", {169, 186});
  part.nominal.left_cylinder_diameter_mm = s.Number("left_cylinder_diameter_mm", {86, 94});
  part.nominal.right_cylinder_diameter_mm = s.Number("right_cylinder_diameter_mm", {85, 92});
  part.length_sd_mm = s.Number("length_sd_mm", {0, 2});
  part.plate_sd_mm = s.Number("plate_sd_mm", {0, 1});
  part.cylinder_sd_mm = s.Number("cylinder_sd_mm", {0, 1});
  part.plate_wear_mm_per_part = s.Number("plate_wear_mm_per_part", {-0.2, 0.2});
  part.cylinder_wear_mm_per_part = s.Number("cylinder_wear_mm_per_part", {-0.2, 0.2});
  part.position_scatter_mm = s.Number("position_scatter_mm", {0, 20});
  part.rotation_scatter_deg = s.Number("rotation_scatter_deg", {0, 5});
  part.length_tolerance_mm = s.Number("length_tolerance_mm", {0.01, 20});
  part.plate_tolerance_mm = s.Number("plate_tolerance_mm", {0.01, 20});
  part.cylinder_tolerance_mm = s.Number("cylinder_tolerance_mm", {0.01, 20});
  RETURN_IF_ERROR(s.Finish());
  ASSIGN_OR_RETURN(part.odd_parts, ReadOddParts(file));
  return part;
}

Result<HeatConfig> ReadHeat(const CellFile& file) {
  TomlSection s = file.Section("heat");
  HeatConfig heat{};
  heat.reference_degc = s.Number("reference_degc", {20, 1200});
  heat.start_degc = s.Number("start_degc", {20, 1200});
  heat.start_sd_k = s.Number("start_sd_k", {0, 50});
  heat.first_view_s = s.Number("first_view_s", {0, 600});
  heat.view_interval_s = s.Number("view_interval_s", {0.1, 60});
  heat.law.emissivity = s.Number("emissivity", {0, 1});
  heat.law.convection_w_per_m2k = s.Number("convection_w_per_m2k", {0, 200});
  heat.law.ambient_degc = s.Number("ambient_degc", {-20, 60});
  heat.law.bar_diameter_mm = s.Number("bar_diameter_mm", {20, 500});
  heat.law.density_kg_per_m3 = s.Number("density_kg_per_m3", {7000, 8500});
  heat.pyrometer_bias_sd_k = s.Number("pyrometer_bias_sd_k", {0, 50});
  heat.pyrometer_noise_sd_k = s.Number("pyrometer_noise_sd_k", {0, 20});
  RETURN_IF_ERROR(s.Finish());
  return heat;
}

Result<RobotScatter> ReadRobot(const CellFile& file) {
  TomlSection s = file.Section("robot");
  RobotScatter robot{};
  robot.position_sd_mm = s.Number("position_sd_mm", {0, 1});
  robot.rotation_sd_rad = s.Number("rotation_sd_rad", {0, 0.01});
  robot.marker_sd_mm = s.Number("marker_sd_mm", {0, 1});
  robot.markers = s.Integer("markers", {4, 100});
  RETURN_IF_ERROR(s.Finish());
  return robot;
}

Result<CalibrationErrorConfig> ReadCalibrationError(const CellFile& file) {
  TomlSection s = file.Section("calibration_error");
  CalibrationErrorConfig error{};
  error.focal_sd_px = s.Number("focal_sd_px", {0, 20});
  error.centre_sd_px = s.Number("centre_sd_px", {0, 20});
  error.k1_sd = s.Number("k1_sd", {0, 0.05});
  error.rotation_sd_rad = s.Number("rotation_sd_rad", {0, 0.01});
  error.translation_sd_mm = s.Number("translation_sd_mm", {0, 2});
  RETURN_IF_ERROR(s.Finish());
  return error;
}

Result<CommissioningErrorConfig> ReadCommissioningError(const CellFile& file) {
  TomlSection s = file.Section("commissioning_error");
  CommissioningErrorConfig error{};
  error.contrast_sd = s.Number("contrast_sd", {0, 0.2});
  error.noise_sd = s.Number("noise_sd", {0, 0.2});
  error.expansion_sd = s.Number("expansion_sd", {0, 0.2});
  error.expansion_point_sd = s.Number("expansion_point_sd", {0, 0.001});
  RETURN_IF_ERROR(s.Finish());
  return error;
}

Result<ProjectorLightConfig> ReadProjectorLight(const CellFile& file) {
  TomlSection s = file.Section("projector_light");
  ProjectorLightConfig light{};
  light.mean_level = s.Number("mean_level", {0.1, 0.6});
  light.amplitude = s.Number("amplitude", {0.01, 0.5});
  light.second_harmonic_ratio = s.Number("second_harmonic_ratio", {0, 0.3});
  light.black_level = s.Number("black_level", {0, 0.1});
  light.blur_px = s.Number("blur_px", {0, 5});
  light.level_sd = s.Number("level_sd", {0, 0.1});
  light.unambiguous_px = s.Number("unambiguous_px", {320, 10000});
  const Eigen::Vector3d counts = s.Vector3("fringe_counts", {1, 200});
  RETURN_IF_ERROR(s.Finish());
  for (const double count : counts) {
    if (count != std::floor(count)) {
      return Fail(ErrorCode::kFormat, "{} [projector_light]: fringe_counts must be whole numbers", file.path);
    }
    light.fringe_counts.push_back(static_cast<int>(count));
  }
  if (light.amplitude > light.mean_level) {
    return Fail(ErrorCode::kFormat, "{} [projector_light]: amplitude is {}, allowed 0.01 to mean_level = {}",
                file.path, light.amplitude, light.mean_level);
  }
  return light;
}

Result<SensorConfig> ReadSensor(const CellFile& file) {
  TomlSection s = file.Section("sensor");
  SensorConfig sensor{};
  sensor.read_noise_dn = s.Number("read_noise_dn", {0, 20});
  sensor.gain_dn = s.Number("gain_dn", {0, 1});
  sensor.dark_level_dn = s.Number("dark_level_dn", {0, 50});
  sensor.white_dn = s.Number("white_dn", {10, 2000});
  sensor.ambient_dn = s.Number("ambient_dn", {0, 200});
  sensor.glow_dn = s.Number("glow_dn", {0, 200});
  sensor.glow_per_k = s.Number("glow_per_k", {0, 0.1});
  RETURN_IF_ERROR(s.Finish());
  return sensor;
}

Result<SurfaceConfig> ReadSurface(const CellFile& file) {
  TomlSection s = file.Section("surface");
  SurfaceConfig surface{};
  surface.part_albedo = s.Number("part_albedo", {0.01, 1});
  surface.cell_albedo = s.Number("cell_albedo", {0.01, 1});
  surface.texture_contrast = s.Number("texture_contrast", {0, 0.9});
  surface.texture_size_mm = s.Number("texture_size_mm", {0.2, 100});
  surface.specular = s.Number("specular", {0, 1});
  RETURN_IF_ERROR(s.Finish());
  return surface;
}

}  // namespace forgescan
