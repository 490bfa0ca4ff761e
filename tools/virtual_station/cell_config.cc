#include "tools/virtual_station/cell_config.h"

#include <cmath>
#include <filesystem>
#include <utility>

#include "services/common/config/toml_text.h"
#include "services/common/input_file.h"
#include "tools/virtual_station/cell_sections.h"

namespace forgescan {
namespace {

constexpr int kCameraWidthPx = 2448;
constexpr int kCameraHeightPx = 2048;
constexpr int kSideStepPx = 4;  // of a virtual camera's sensor

Result<Lens> ReadLens(const CellFile& file, const std::string& section_name, double scale) {
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

Status ReadRig(const CellFile& file, int scale_divisor, CellConfig& config) {
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
    camera->width_px = kCameraWidthPx / divisor / kSideStepPx * kSideStepPx;
    camera->height_px = kCameraHeightPx / divisor / kSideStepPx * kSideStepPx;
  }
  const double distance = config.working_distance_mm;
  config.rig.left.camera_from_rig = LookingAt({-0.5 * baseline, 0.0, 0.0}, distance);
  config.rig.right.camera_from_rig = LookingAt({0.5 * baseline, 0.0, 0.0}, distance);
  config.rig.projector.camera_from_rig = LookingAt(projector_in_rig, distance);
  return {};
}

Result<std::vector<ViewConfig>> ReadViews(const CellFile& file) {
  ASSIGN_OR_RETURN(const auto tables, file.Tables("view"));
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

Result<std::vector<BoxConfig>> ReadBoxes(const CellFile& file) {
  ASSIGN_OR_RETURN(const auto tables, file.Tables("box"));
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

Result<std::vector<PostConfig>> ReadPosts(const CellFile& file) {
  std::vector<PostConfig> posts;
  if (!file.root.contains("post")) {
    return posts;
  }
  ASSIGN_OR_RETURN(const auto tables, file.Tables("post"));
  for (const toml::table* table : tables) {
    const std::string place = fmt::format("{} [[post]] {}", file.path, posts.size());
    TomlSection s(table, place);
    PostConfig post;
    post.top_mm = s.Vector3("top_mm", {-5000, 5000});
    post.width_mm = s.Number("width_mm", {1, 1000});
    post.foot_z_mm = s.Number("foot_z_mm", {-5000, 5000});
    post.turn_deg = s.Number("turn_deg", {-90, 90});
    RETURN_IF_ERROR(s.Finish());
    if (!(post.foot_z_mm < post.top_mm.z())) {
      return Fail(ErrorCode::kFormat, "{}: foot_z_mm must be below the z of top_mm", place);
    }
    posts.push_back(post);
  }
  return posts;
}

// Every section is known, and `seed` is the only key outside them.
Status CheckSections(const CellFile& file) {
  const std::set<std::string> known = {
      "projector", "surface", "rig",      "image",           "commissioning_error", "seed",
      "robot",     "part",    "odd_part", "projector_light", "camera_right",        "post",
      "box",       "view",    "heat",     "sensor",          "calibration_error",   "camera_left"};
  for (const auto& [key, node] : file.root) {
    if (!known.contains(std::string(key.str()))) {
      return Fail(ErrorCode::kFormat, "{}: {} is not a section or key of the virtual cell", file.path,
                  key.str());
    }
  }
  return {};
}

Result<CellConfig> ReadConfig(const CellFile& file, int scale_divisor) {
  RETURN_IF_ERROR(CheckSections(file));
  CellConfig config;
  const auto seed = file.root["seed"].value_exact<std::int64_t>();
  if (!seed || *seed < 0) {
    return Fail(ErrorCode::kFormat, "{}: seed must be a whole number >= 0", file.path);
  }
  config.seed = static_cast<std::uint64_t>(*seed);
  RETURN_IF_ERROR(ReadRig(file, scale_divisor, config));
  ASSIGN_OR_RETURN(config.part, ReadPart(file));
  ASSIGN_OR_RETURN(config.heat, ReadHeat(file));
  ASSIGN_OR_RETURN(config.robot, ReadRobot(file));
  ASSIGN_OR_RETURN(config.calibration_error, ReadCalibrationError(file));
  ASSIGN_OR_RETURN(config.commissioning_error, ReadCommissioningError(file));
  ASSIGN_OR_RETURN(config.projector_light, ReadProjectorLight(file));
  ASSIGN_OR_RETURN(config.sensor, ReadSensor(file));
  ASSIGN_OR_RETURN(config.surface, ReadSurface(file));
  ASSIGN_OR_RETURN(config.views, ReadViews(file));
  ASSIGN_OR_RETURN(config.boxes, ReadBoxes(file));
  ASSIGN_OR_RETURN(config.posts, ReadPosts(file));
  return config;
}

}  // namespace

Result<CellConfig> LoadCellConfig(const std::string& path, int scale_divisor) {
  if (!std::filesystem::is_regular_file(path)) {
    return Fail(ErrorCode::kNotFound, "{}: there is no such file", path);
  }
  ASSIGN_OR_RETURN(const std::string text, ReadInputFile(path));
  RETURN_IF_ERROR(CheckTomlText(text, path));
  try {
    const toml::table root = toml::parse(text, path);
    return ReadConfig({root, path}, scale_divisor);
  } catch (const toml::parse_error& error) {
    return Fail(ErrorCode::kFormat, "{}: line {}: {}", path, error.source().begin.line, error.description());
  }
}

}  // namespace forgescan
