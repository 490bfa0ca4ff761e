#include "tools/virtual_station/truth.h"

#include <array>
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

struct TrueDimension {
  const char* name;
  double value_mm, nominal_mm, tolerance_mm;
  bool IsOk() const { return std::abs(value_mm - nominal_mm) <= tolerance_mm; }
};

std::array<TrueDimension, 5> Dimensions(const PartConfig& config, const AxleSize& size) {
  const AxleSize& nominal = config.nominal;
  return {
      {{"total_length", size.total_length_mm, nominal.total_length_mm, config.length_tolerance_mm},
       {"left_plate_width", size.left_plate_width_mm, nominal.left_plate_width_mm, config.plate_tolerance_mm},
       {"right_plate_width", size.right_plate_width_mm, nominal.right_plate_width_mm,
        config.plate_tolerance_mm},
       {"left_cylinder_diameter", size.left_cylinder_diameter_mm, nominal.left_cylinder_diameter_mm,
        config.cylinder_tolerance_mm},
       {"right_cylinder_diameter", size.right_cylinder_diameter_mm, nominal.right_cylinder_diameter_mm,
        config.cylinder_tolerance_mm}}};
}

Json ViewTruth(const ViewState& view) {
  const Eigen::AngleAxisd turn(view.taught_from_actual.linear());
  const Eigen::Vector3d shift = view.taught_from_actual.translation();
  const Eigen::Vector3d rotation = turn.angle() * turn.axis();
  return {{"view", view.view},
          {"visit", view.visit},
          {"time_s", view.time_s},
          {"part_degc", view.part_degc},
          {"pyrometer_degc", view.pyrometer_degc},
          {"scale", view.scale},
          {"robot_shift_mm", {shift.x(), shift.y(), shift.z()}},
          {"robot_rotation_rad", {rotation.x(), rotation.y(), rotation.z()}},
          {"array_from_rig", Matrix(view.array_from_rig)}};
}

}  // namespace

Status WriteTruth(const CellConfig& config, const PartState& part, const std::vector<ViewState>& views,
                  const std::string& path) {
  Json truth = {{"part", part.part},
                {"verdict", "OK"},
                {"reference_temperature_degc", config.heat.reference_degc},
                {"dimensions", Json::object()},
                {"limits", Json::object()},
                {"array_from_part", Matrix(part.array_from_part)},
                {"start_degc", part.start_degc},
                {"pyrometer_bias_k", part.pyrometer_bias_k},
                {"views", Json::array()}};
  for (const TrueDimension& dimension : Dimensions(config.part, part.size)) {
    truth["dimensions"][dimension.name] = dimension.value_mm;
    truth["limits"][dimension.name] = {{"lower_mm", dimension.nominal_mm - dimension.tolerance_mm},
                                       {"upper_mm", dimension.nominal_mm + dimension.tolerance_mm},
                                       {"verdict", dimension.IsOk() ? "OK" : "NOT_OK"}};
    if (!dimension.IsOk()) {
      truth["verdict"] = "NOT_OK";
    }
  }
  for (const ViewState& view : views) {
    truth["views"].push_back(ViewTruth(view));
  }
  return WriteWholeFile(path, truth.dump(1) + "\n");
}

Status WriteTruth(const VirtualCell& cell, const PartState& part, const std::string& path) {
  std::vector<ViewState> views;
  for (std::size_t i = 0; i < cell.config().views.size(); ++i) {
    ASSIGN_OR_RETURN(ViewState view, cell.View(part, static_cast<int>(i)));
    views.push_back(std::move(view));
  }
  return WriteTruth(cell.config(), part, views, path);
}

}  // namespace forgescan
