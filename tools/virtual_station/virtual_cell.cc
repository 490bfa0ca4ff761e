#include "tools/virtual_station/virtual_cell.h"

#include "tools/virtual_station/scene.h"

namespace forgescan {

VirtualCell::VirtualCell(CellConfig config, int threads)
    : config_(std::move(config)),
      threads_(threads),
      cell_in_array_(BuildCellMesh(config_.boxes)),
      left_rays_(BuildRayTable(config_.rig.left, threads)),
      right_rays_(BuildRayTable(config_.rig.right, threads)) {
  Append(BuildPostMesh(config_.posts), cell_in_array_);
}

Result<PartState> VirtualCell::Part(int part) const {
  if (part < 0) {
    return Fail(ErrorCode::kInvalidArgument, "part number is {}, allowed 0 and up", part);
  }
  PartState state;
  state.part = part;
  state.size = ActualSize(config_.part, config_.seed, part);
  state.array_from_part = ArrayFromPart(config_.part, config_.seed, part);
  RandomStream heat(config_.seed, RandomUse::kPartHeat, {part});
  state.start_degc = config_.heat.start_degc + config_.heat.start_sd_k * heat.Gaussian();
  // One pyrometer for all parts: its bias belongs to the station, not to the part.
  state.pyrometer_bias_k =
      config_.heat.pyrometer_bias_sd_k * RandomStream(config_.seed, RandomUse::kPyrometer).Gaussian();
  ASSIGN_OR_RETURN(state.mesh_in_part, BuildAxleMesh(state.size));
  return state;
}

Result<ViewState> VirtualCell::View(const PartState& part, int view) const {
  return View(part, view, config_.heat.first_view_s + view * config_.heat.view_interval_s, 0);
}

Result<ViewState> VirtualCell::View(const PartState& part, int view, double time_s, int visit) const {
  if (view < 0 || static_cast<std::size_t>(view) >= config_.views.size()) {
    return Fail(ErrorCode::kInvalidArgument, "view is {}, the path has views 0 to {}", view,
                config_.views.size() - 1);
  }
  ViewState state;
  state.part = part.part;
  state.view = view;
  state.visit = visit;
  state.time_s = time_s;
  ASSIGN_OR_RETURN(state.part_degc, TemperatureAfter(config_.heat.law, part.start_degc, state.time_s));
  ASSIGN_OR_RETURN(state.scale, SizeScale(state.part_degc, config_.heat.reference_degc));
  RandomStream reading(config_.seed, RandomUse::kPyrometer, {part.part, view, visit});
  state.pyrometer_degc =
      Pyrometer{part.pyrometer_bias_k, config_.heat.pyrometer_noise_sd_k}.Read(state.part_degc, reading);
  RandomStream error(config_.seed, RandomUse::kRobotVisit, {part.part, view, visit});
  state.taught_from_actual = SmallMotion(error, config_.robot.position_sd_mm, config_.robot.rotation_sd_rad);
  const ViewConfig& taught = config_.views[static_cast<std::size_t>(view)];
  state.array_from_rig = TaughtRigPose(taught, config_.working_distance_mm) * state.taught_from_actual;
  return state;
}

Result<GeometryMap> VirtualCell::Map(const PartState& part, const ViewState& view, Side side) const {
  ASSIGN_OR_RETURN(const PosedScene scene,
                   PosedScene::Build(part.mesh_in_part, part.array_from_part, view.scale, cell_in_array_));
  ShadingSettings shading;
  shading.sensor = config_.sensor;
  shading.surface = config_.surface;
  shading.working_distance_mm = config_.working_distance_mm;
  shading.exposure = config_.views[static_cast<std::size_t>(view.view)].exposure;
  shading.part_temperature_degc = view.part_degc;
  shading.texture_seed = RandomStream(config_.seed, RandomUse::kTexture, {part.part}).Bits();
  shading.part_from_array = part.array_from_part.inverse();
  const RayTable& rays = side == Side::kLeft ? left_rays_ : right_rays_;
  return BuildGeometryMap(scene, {config_.rig, side, rays, view.array_from_rig, shading, threads_});
}

std::vector<Pattern> VirtualCell::Patterns(ProjectedSet set) const {
  return ProjectedPatterns(config_.projector_light, set);
}

std::vector<std::uint8_t> VirtualCell::Image(const GeometryMap& map, const ViewState& view, Side side,
                                             const Pattern& pattern, int pattern_index) const {
  const ImageKey key{config_.seed, view.part, view.view, view.visit, side, pattern_index};
  return ExposeImage(map, {config_.projector_light, config_.sensor, pattern, key, threads_});
}

}  // namespace forgescan
