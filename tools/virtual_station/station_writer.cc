#include "tools/virtual_station/station_writer.h"

#include <libdeflate.h>

#include <filesystem>

#include "services/common/imaging/stereo_calibration_text.h"
#include "tools/virtual_station/commissioning.h"
#include "tools/virtual_station/teaching.h"
#include "tools/virtual_station/whole_file.h"

namespace forgescan {
namespace {

// Of the robot's body when its views were taught.
constexpr double kRobotTeachingDegc = 35.0;

std::string FrequencyText(const std::vector<Pattern>& patterns, double period_px, double modulation_ratio) {
  std::string frames, shifts;
  for (std::size_t i = 0; i < patterns.size(); ++i) {
    if (patterns[i].period_px == period_px) {
      const char* comma = frames.empty() ? "" : ", ";
      frames += fmt::format("{}\"pattern_{:02}.png\"", comma, i);
      shifts += fmt::format("{}{:.1f}", comma, patterns[i].shift_deg);
    }
  }
  return fmt::format(
      "\n[[frequency]]\nperiod_px = {:.17g}\nframes = [{}]\nshifts_deg = [{}]\nmodulation_ratio = {:.5f}\n",
      period_px, frames, shifts, modulation_ratio);
}

// Frequencies in the order of projection, so that the order of listing is the order of the frames.
std::string PatternText(const CellConfig& config, ProjectedSet set) {
  const std::vector<Pattern> patterns = ProjectedPatterns(config.projector_light, set);
  const MeasuredPattern measured = MeasurePattern(config, set);
  std::string text = fmt::format(
      "projector_width_px = {}\nbackground = \"{}\"\nreference = \"pattern_{:02}.png\"\n",
      config.rig.projector.width_px, set == ProjectedSet::kReduced ? "shared" : "own", patterns.size() - 1);
  text += fmt::format("reference_contrast = {:.5f}\n", measured.reference_contrast);
  auto ratio = measured.modulation_ratio.begin();
  double last_period_px = 0.0;
  for (const Pattern& pattern : patterns) {
    if (pattern.period_px != last_period_px && pattern.period_px != 0.0) {
      text += FrequencyText(patterns, pattern.period_px, *ratio++);
    }
    last_period_px = pattern.period_px;
  }
  return text;
}

std::string ViewsText(const CellConfig& config, const std::vector<Eigen::Isometry3d>& array_from_camera) {
  std::string text = fmt::format("path_crc32 = {}\nrecorded_body_degc = {:.1f}\n", PathCrc32(config.views),
                                 kRobotTeachingDegc);
  for (std::size_t view = 0; view < array_from_camera.size(); ++view) {
    text += fmt::format("\n[[view]]\nindex = {}\narray_from_camera = [", view);
    for (int i = 0; i < 16; ++i) {
      text += fmt::format("{}{:.17g}",
                          i == 0       ? ""
                          : i % 4 == 0 ? ",\n  "
                                       : ", ",
                          array_from_camera[view].matrix()(i / 4, i % 4));
    }
    text += "]\n";
  }
  return text;
}

struct Limits {
  double low, high;
};

std::string DimensionText(const std::string& name, const std::string& type, const std::string& faces,
                          Limits limits) {
  return fmt::format(
      "\n[[dimension]]\nname = \"{}\"\ntype = \"{}\"\n{}\nlower_mm = {:.3f}\nupper_mm = {:.3f}\n", name, type,
      faces, limits.low, limits.high);
}

std::string FeaturesText(const CellConfig& config) {
  const PartConfig& part = config.part;
  const auto about = [](double nominal, double tolerance) {
    return Limits{nominal - tolerance, nominal + tolerance};
  };
  std::string text =
      fmt::format("part = \"axle\"\nreference_temperature_degc = {:.1f}\n", config.heat.reference_degc);
  text += DimensionText(
      "total_length", "length",
      "faces = [\"left_end_face\", \"right_end_face\"]\ndatum = [\"left_cylinder\", \"right_cylinder\"]",
      about(part.nominal.total_length_mm, part.length_tolerance_mm));
  text += DimensionText("left_plate_width", "width", "faces = [\"left_plate_front\", \"left_plate_back\"]",
                        about(part.nominal.left_plate_width_mm, part.plate_tolerance_mm));
  text += DimensionText("right_plate_width", "width", "faces = [\"right_plate_front\", \"right_plate_back\"]",
                        about(part.nominal.right_plate_width_mm, part.plate_tolerance_mm));
  text += DimensionText("left_cylinder_diameter", "diameter", "faces = [\"left_cylinder\"]",
                        about(part.nominal.left_cylinder_diameter_mm, part.cylinder_tolerance_mm));
  text += DimensionText("right_cylinder_diameter", "diameter", "faces = [\"right_cylinder\"]",
                        about(part.nominal.right_cylinder_diameter_mm, part.cylinder_tolerance_mm));
  return text;
}

Status MakeFolders(const std::filesystem::path& directory) {
  for (const char* folder : {"calibration", "views", "model"}) {
    std::error_code error;
    std::filesystem::create_directories(directory / folder, error);
    if (error) {
      return Fail(ErrorCode::kIo, "{}: {}", (directory / folder).string(), error.message());
    }
  }
  return {};
}

}  // namespace

std::uint32_t PathCrc32(const std::vector<ViewConfig>& views) {
  std::string path;
  for (const ViewConfig& view : views) {
    for (const Eigen::Vector3d& v : {view.target_mm, view.towards_rig, view.baseline}) {
      path += fmt::format("{:.17g} {:.17g} {:.17g}\n", v.x(), v.y(), v.z());
    }
  }
  return libdeflate_crc32(0, path.data(), path.size());
}

Status WriteStation(const CellConfig& config, ProjectedSet set, const std::string& directory) {
  const std::filesystem::path folder(directory);
  RETURN_IF_ERROR(MakeFolders(folder));
  const Rig calibrated = CalibratedRig(config);
  RETURN_IF_ERROR(WriteWholeFile((folder / "calibration/stereo.yaml").string(),
                                 StereoCalibrationText(CalibrationOf(calibrated))));
  RETURN_IF_ERROR(WriteWholeFile((folder / "pattern.toml").string(), PatternText(config, set)));
  RETURN_IF_ERROR(WriteWholeFile((folder / "views/views.toml").string(),
                                 ViewsText(config, TeachViews(config, calibrated))));
  RETURN_IF_ERROR(WriteWholeFile((folder / "model/features.toml").string(), FeaturesText(config)));
  RETURN_IF_ERROR(WriteAxleStl(config.part.nominal, (folder / "model/axle.stl").string()));
  return WriteAxleStep(config.part.nominal, (folder / "model/axle.step").string());
}

}  // namespace forgescan
