// The simulated cell as one object: parts, views, images and their truth, each computable alone and in any
// order.
#pragma once

#include <memory>

#include "tools/virtual_station/cell_config.h"
#include "tools/virtual_station/exposure.h"
#include "tools/virtual_station/geometry_map.h"

namespace forgescan {

// A part on the conveyor. Lengths at the reference temperature.
struct PartState {
  int part = 0;
  AxleSize size;
  Eigen::Isometry3d array_from_part = Eigen::Isometry3d::Identity();
  double start_degc = 0.0;
  double pyrometer_bias_k = 0.0;
  SurfaceMesh mesh_in_part;
};

// The cell at the moment of one view of one part.
struct ViewState {
  int part = 0, view = 0;
  int visit = 0;        // 0, 1, ...: the robot comes to a view again after a void capture
  double time_s = 0.0;  // after start_degc
  double part_degc = 0.0;
  double pyrometer_degc = 0.0;
  double scale = 1.0;                    // size now / size at the reference temperature
  Eigen::Isometry3d taught_from_actual;  // error of the robot in this visit, rig frame
  Eigen::Isometry3d array_from_rig;      // where the rig truly is
};

class VirtualCell {
 public:
  VirtualCell(CellConfig config, int threads);

  const CellConfig& config() const { return config_; }

  // Cost: 0.3 s (the mesh). Errors: kInvalidArgument for a negative part number or a size beyond the axle's
  // limits.
  Result<PartState> Part(int part) const;

  // Errors: kInvalidArgument for a view that does not exist or a temperature outside the steel's tables.
  Result<ViewState> View(const PartState& part, int view, double time_s, int visit) const;
  // The first visit, at the time the configuration plans for it.
  Result<ViewState> View(const PartState& part, int view) const;

  // Errors: as View.
  Result<GeometryMap> Map(const PartState& part, const ViewState& view, Side side) const;

  std::vector<Pattern> Patterns(ProjectedSet set) const;

  // One 8-bit image; `pattern_index` counts in the order of projection and selects the noise.
  std::vector<std::uint8_t> Image(const GeometryMap& map, const ViewState& view, Side side,
                                  const Pattern& pattern, int pattern_index) const;

 private:
  CellConfig config_;
  int threads_;
  SurfaceMesh cell_in_array_;
  RayTable left_rays_, right_rays_;
};

}  // namespace forgescan
