#include "tools/virtual_station/truth.h"

#include <cmath>
#include <nlohmann/json.hpp>

#include "tools/virtual_station/whole_file.h"

namespace forgescan {
namespace {

using Json = nlohmann::ordered_json;

Json Matrix(const Eigen::Isometry3d& transform) {
  Json rows = Json::array();
  for (int i = 0; i < 16; ++i) {
    rows.push_back(transform.matrix()(i / 4, i % 4));
  }
  return rows;
}

Json Dimension(double value_mm, double nominal_mm, double tolerance_mm) {
  return {{"value_mm", value_mm},
          {"lower_mm", nominal_mm - tolerance_mm},
          {"upper_mm", nominal_mm + tolerance_mm},
          {"verdict", std::abs(value_mm - nominal_mm) <= tolerance_mm ? "OK" : "NOT_OK"}};
}

Json Dimensions(const PartConfig& config, const AxleSize& size) {
  const AxleSize& nominal = config.nominal;
  return {
      {"total_length", Dimension(size.total_length_mm, nominal.total_length_mm, config.length_tolerance_mm)},
      {"left_plate_width",
       Dimension(size.left_plate_width_mm, nominal.left_plate_width_mm, config.plate_tolerance_mm)},
      {"right_plate_width",
       Dimension(size.right_plate_width_mm, nominal.right_plate_width_mm, config.plate_tolerance_mm)},
      {"left_cylinder_diameter", Dimension(size.left_cylinder_diameter_mm, nominal.left_cylinder_diameter_mm,
                                           config.cylinder_tolerance_mm)},
      {"right_cylinder_diameter",
       Dimension(size.right_cylinder_diameter_mm, nominal.right_cylinder_diameter_mm,
                 config.cylinder_tolerance_mm)}};
}

Json ViewTruth(const ViewState& view) {
  const Eigen::AngleAxisd turn(view.taught_from_actual.linear());
  const Eigen::Vector3d shift = view.taught_from_actual.translation();
  const Eigen::Vector3d rotation = turn.angle() * turn.axis();
  return {{"view", view.view},
          {"time_s", view.time_s},
          {"part_degc", view.part_degc},
          {"pyrometer_degc", view.pyrometer_degc},
          {"scale", view.scale},
          {"robot_shift_mm", {shift.x(), shift.y(), shift.z()}},
          {"robot_rotation_rad", {rotation.x(), rotation.y(), rotation.z()}},
          {"array_from_rig", Matrix(view.array_from_rig)}};
}

}  // namespace

Status WriteTruth(const VirtualCell& cell, const PartState& part, const std::string& path) {
  Json truth = {{"part", part.part},
                {"reference_temperature_degc", cell.config().heat.reference_degc},
                {"dimensions", Dimensions(cell.config().part, part.size)},
                {"array_from_part", Matrix(part.array_from_part)},
                {"start_degc", part.start_degc},
                {"views", Json::array()}};
  for (std::size_t i = 0; i < cell.config().views.size(); ++i) {
    ASSIGN_OR_RETURN(const ViewState view, cell.View(part, static_cast<int>(i)));
    truth["views"].push_back(ViewTruth(view));
  }
  return WriteWholeFile(path, truth.dump(1) + "\n");
}

}  // namespace forgescan
