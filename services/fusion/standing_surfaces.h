// What stands still about the part (posts, rests, rails), as each view saw it without a part: the reference
// by which visit_error tells how far the robot is from where it was taught.
#pragma once

#include <Eigen/Geometry>
#include <cstdint>
#include <span>
#include <vector>

#include "services/fusion/fuse.h"
#include "services/fusion/visit_error.h"

namespace forgescan {

// What the surfaces were seen with. They hold for it alone.
struct StandingOrigin {
  std::uint32_t path_crc32 = 0;         // of the robot's path
  std::uint32_t calibration_crc32 = 0;  // of the calibration's file, byte by byte

  bool operator==(const StandingOrigin&) const = default;
};

struct StandingSurfaces {
  StandingOrigin origin;
  double cell_rad = SurfaceCellOptions().cell_rad;
  int scans = 0;                                // that were averaged
  std::vector<std::vector<SurfaceCell>> views;  // one a view of the path, camera frame, ascending keys
};

struct StandingRequest {
  StandingOrigin origin;
  const ViewMatrices& matrices;
  // Array frame, mm: what stands still lies in one of them. All else (clamps, belts, doors) does not count.
  std::span<const Eigen::AlignedBox3d> regions;
  VisitErrorOptions visit;  // of the robot whose scans these are
};

// Two visits differ by more than one scatters: by the error of the second and that of the first, which is the
// mean of so many scans. With the robot's standard deviations of that.
VisitErrorOptions AgainstMeanOf(int scans, VisitErrorOptions options);

// Purpose: the reference from scans of the cell without a part, each a cloud for some of the views; the
// temperatures of the views are not used. Method: each cloud is moved into the first one of its view
// (visit_error), then all by the mean of these motions, so that no single visit's error is in the reference;
// the cells are those of all points together. Frames: camera. Errors: kInvalidArgument (no scan, no region, a
// view without matrix), kUntrusted (a scan that differs from the first by more than the robot scatters; no
// surface in the regions).
Result<StandingSurfaces> MakeStandingSurfaces(std::span<const std::vector<ViewCloud>> scans,
                                              const StandingRequest& request);

}  // namespace forgescan
