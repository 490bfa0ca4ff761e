// What stands in the cell and from where it is seen. Frames: array = the frame of the taught views, in which
// the design model lies at its nominal pose. Units: mm, rad.
#pragma once

#include <Eigen/Geometry>

#include "tools/virtual_station/cell_config.h"
#include "tools/virtual_station/surface_mesh.h"

namespace forgescan {

// Conveyor, brackets and clamp: the boxes of the configuration. Large faces are cut into squares of at most
// 25 mm, so that the renderer can tell which parts of the image see something.
SurfaceMesh BuildCellMesh(const std::vector<BoxConfig>& boxes);

// The same of the posts.
SurfaceMesh BuildPostMesh(const std::vector<PostConfig>& posts);

// Where the robot was taught to stand for this view.
Eigen::Isometry3d TaughtRigPose(const ViewConfig& view, double working_distance_mm);

// A small rigid motion: rotation vector and shift, each component Gaussian.
Eigen::Isometry3d SmallMotion(RandomStream& random, double position_sd_mm, double rotation_sd_rad);

// The true size of part `part` (0, 1, ...) at the reference temperature: seeded variation plus die
// wear, and what went wrong with it.
AxleSize ActualSize(const PartConfig& config, std::uint64_t seed, int part);

// How part `part` lies on the conveyor.
Eigen::Isometry3d ArrayFromPart(const PartConfig& config, std::uint64_t seed, int part);

}  // namespace forgescan
