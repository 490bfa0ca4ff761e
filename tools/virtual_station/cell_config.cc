#include "tools/virtual_station/cell_config.h"

#include <cmath>
#include <filesystem>
#include <numbers>
#include <utility>

#include "tools/virtual_station/toml_section.h"

namespace forgescan {
namespace {

constexpr int kCameraWidthPx = 2448;
constexpr int kCameraHeightPx = 2048;
constexpr double kDegree = std::numbers::pi / 180.0;

struct File {
  const toml::table& root;
  std::string path;

  TomlSection Section(const std::string& name) const {
    return {root.get_as<toml::table>(name), fmt::format("{} [{}]", path, name)};
  }
};

Result<Lens> ReadLens(const File& file, const std::string& section_name, double scale) {
  TomlSection s = file.Section(section_name);
  Lens lens;
  lens.fx_px = scale * s.Number("focal_x_px", {500, 20000});
  lens.fy_px = scale * s.Number("focal_y_px", {500, 20000});
  // Pixel centres are at integers, so the image's corner, which scaling leaves in place, is at -0.5.
  lens.cx_px = scale * (s.Number("centre_x_px", {0, 5000}) + 0.5) - 0.5;
  lens.cy_px = scale * (s.Number("centre_y_px", {0, 5000}) + 0.5) - 0.5;
  const char* keys[] = {"k1", "k2", "p1", "p2", "k3"};
  for (std::size_t i = 0; i < 5; ++i) {
    lens.distortion[i] = s.Number(keys[i], {-0.5, 0.5});
  }
  RETURN_IF_ERROR(s.Finish());
  return lens;
}

// A device at `place` in the rig that looks at (0, 0, distance), its rows parallel to the rig's x-z plane.
Eigen::Isometry3d LookingAt(const Eigen::Vector3d& place_in_rig, double distance) {
  const Eigen::Vector3d z = (Eigen::Vector3d(0.0, 0.0, distance) - place_in_rig).normalized();
  const Eigen::Vector3d x = (Eigen::Vector3d::UnitX() - z.x() * z).normalized();
  Eigen::Isometry3d rig_from_device = Eigen::Isometry3d::Identity();
  rig_from_device.linear() << x, z.cross(x), z;
  rig_from_device.translation() = place_in_rig;
  return rig_from_device.inverse();
}

Status ReadRig(const File& file, int scale_divisor, CellConfig& config) {
  TomlSection image = file.Section("image");
  const int divisor_in_file = image.Integer("scale_divisor", {1, 8});
  RETURN_IF_ERROR(image.Finish());
  const int divisor = scale_divisor == 0 ? divisor_in_file : scale_divisor;
  if (divisor != 1 && divisor != 2 && divisor != 4 && divisor != 8) {
    return Fail(ErrorCode::kFormat, "{} [image]: scale_divisor is {}, allowed 1, 2, 4 or 8", file.path,
                divisor);
  }
  TomlSection s = file.Section("rig");
  const double baseline = s.Number("baseline_mm", {50, 1000});
  const Eigen::Vector3d projector_in_rig = s.Vector3("projector_mm", {-500, 500});
  config.working_distance_mm = s.Number("working_distance_mm", {200, 3000});
  config.rig.projector.width_px = s.Integer("projector_width_px", {320, 8192});
  config.rig.projector.height_px = s.Integer("projector_height_px", {240, 8192});
  RETURN_IF_ERROR(s.Finish());
  ASSIGN_OR_RETURN(config.rig.left.lens, ReadLens(file, "camera_left", 1.0 / divisor));
  ASSIGN_OR_RETURN(config.rig.right.lens, ReadLens(file, "camera_right", 1.0 / divisor));
  ASSIGN_OR_RETURN(config.rig.projector.lens, ReadLens(file, "projector", 1.0));
  for (PinholeCamera* camera : {&config.rig.left, &config.rig.right}) {
    camera->width_px = kCameraWidthPx / divisor;
    camera->height_px = kCameraHeightPx / divisor;
  }
  const double distance = config.working_distance_mm;
  config.rig.left.camera_from_rig = LookingAt({-0.5 * baseline, 0.0, 0.0}, distance);
  config.rig.right.camera_from_rig = LookingAt({0.5 * baseline, 0.0, 0.0}, distance);
  config.rig.projector.camera_from_rig = LookingAt(projector_in_rig, distance);
  return {};
}

Result<PartConfig> ReadPart(const File& file) {
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
  return part;
}

Result<HeatConfig> ReadHeat(const File& file) {
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

Result<RobotScatter> ReadRobot(const File& file) {
  TomlSection s = file.Section("robot");
  RobotScatter robot{};
  robot.position_sd_mm = s.Number("position_sd_mm", {0, 1});
  robot.rotation_sd_rad = s.Number("rotation_sd_rad", {0, 0.01});
  robot.marker_sd_mm = s.Number("marker_sd_mm", {0, 1});
  robot.markers = s.Integer("markers", {4, 100});
  RETURN_IF_ERROR(s.Finish());
  return robot;
}

Result<CalibrationErrorConfig> ReadCalibrationError(const File& file) {
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

Result<ProjectorLightConfig> ReadProjectorLight(const File& file) {
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

Result<SensorConfig> ReadSensor(const File& file) {
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

Result<SurfaceConfig> ReadSurface(const File& file) {
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

// The tables of an array of tables. Errors: kFormat if it is missing, empty or something else.
Result<std::vector<const toml::table*>> Tables(const File& file, const std::string& name) {
  const toml::array* array = file.root.get_as<toml::array>(name);
  if (array == nullptr || array->empty() || !array->is_array_of_tables()) {
    return Fail(ErrorCode::kFormat, "{}: [[{}]] must be given at least once", file.path, name);
  }
  std::vector<const toml::table*> tables;
  for (const toml::node& node : *array) {
    tables.push_back(node.as_table());
  }
  return tables;
}

Result<std::vector<ViewConfig>> ReadViews(const File& file) {
  ASSIGN_OR_RETURN(const auto tables, Tables(file, "view"));
  std::vector<ViewConfig> views;
  for (const toml::table* table : tables) {
    const std::string place = fmt::format("{} [[view]] {}", file.path, views.size());
    TomlSection s(table, place);
    ViewConfig view;
    view.target_mm = s.Vector3("target_mm", {-3000, 3000});
    view.towards_rig = s.Vector3("towards_rig", {-1, 1});
    view.baseline = s.Vector3("baseline", {-1, 1});
    view.exposure = s.Number("exposure", {0.01, 100});
    RETURN_IF_ERROR(s.Finish());
    if (!(view.towards_rig.cross(view.baseline).norm() > 0.1)) {
      return Fail(ErrorCode::kFormat, "{}: towards_rig and baseline must not be zero or nearly parallel",
                  place);
    }
    views.push_back(view);
  }
  return views;
}

Result<std::vector<BoxConfig>> ReadBoxes(const File& file) {
  ASSIGN_OR_RETURN(const auto tables, Tables(file, "box"));
  std::vector<BoxConfig> boxes;
  for (const toml::table* table : tables) {
    const std::string place = fmt::format("{} [[box]] {}", file.path, boxes.size());
    TomlSection s(table, place);
    const BoxConfig box{s.Vector3("low_mm", {-5000, 5000}), s.Vector3("high_mm", {-5000, 5000})};
    RETURN_IF_ERROR(s.Finish());
    if (!(box.low_mm.array() < box.high_mm.array()).all()) {
      return Fail(ErrorCode::kFormat, "{}: low_mm must be below high_mm on every axis", place);
    }
    boxes.push_back(box);
  }
  return boxes;
}

// Every section is known, and `seed` is the only key outside them.
Status CheckSections(const File& file) {
  const std::set<std::string> known = {
      "seed",    "image", "rig",   "camera_left",       "camera_right",    "projector",
      "part",    "heat",  "robot", "calibration_error", "projector_light", "sensor",
      "surface", "view",  "box"};
  for (const auto& [key, node] : file.root) {
    if (!known.contains(std::string(key.str()))) {
      return Fail(ErrorCode::kFormat, "{}: {} is not a section or key of the virtual cell", file.path,
                  key.str());
    }
  }
  return {};
}

Result<CellConfig> ReadConfig(const File& file, int scale_divisor) {
  RETURN_IF_ERROR(CheckSections(file));
  CellConfig config;
  const auto seed = file.root["seed"].value<std::int64_t>();
  if (!seed || *seed < 0) {
    return Fail(ErrorCode::kFormat, "{}: seed must be a whole number >= 0", file.path);
  }
  config.seed = static_cast<std::uint64_t>(*seed);
  RETURN_IF_ERROR(ReadRig(file, scale_divisor, config));
  ASSIGN_OR_RETURN(config.part, ReadPart(file));
  ASSIGN_OR_RETURN(config.heat, ReadHeat(file));
  ASSIGN_OR_RETURN(config.robot, ReadRobot(file));
  ASSIGN_OR_RETURN(config.calibration_error, ReadCalibrationError(file));
  ASSIGN_OR_RETURN(config.projector_light, ReadProjectorLight(file));
  ASSIGN_OR_RETURN(config.sensor, ReadSensor(file));
  ASSIGN_OR_RETURN(config.surface, ReadSurface(file));
  ASSIGN_OR_RETURN(config.views, ReadViews(file));
  ASSIGN_OR_RETURN(config.boxes, ReadBoxes(file));
  return config;
}

}  // namespace

Result<CellConfig> LoadCellConfig(const std::string& path, int scale_divisor) {
  if (!std::filesystem::is_regular_file(path)) {
    return Fail(ErrorCode::kNotFound, "{}: there is no such file", path);
  }
  try {
    const toml::table root = toml::parse_file(path);
    return ReadConfig({root, path}, scale_divisor);
  } catch (const toml::parse_error& error) {
    return Fail(ErrorCode::kFormat, "{}: line {}: {}", path, error.source().begin.line, error.description());
  }
}

}  // namespace forgescan
