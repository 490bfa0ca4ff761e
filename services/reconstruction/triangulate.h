// Disparities -> points with normals and predicted standard deviations.
#pragma once

#include <optional>
#include <vector>

#include "services/common/geometry/point_cloud.h"
#include "services/reconstruction/disparity.h"
#include "services/reconstruction/projector_consistency.h"
#include "services/reconstruction/stereo_rig.h"

namespace forgescan {

struct Triangulation {
  PointCloud
      cloud_in_camera;  // scanner order: rows of the rectified left image from the top, each from the left
  std::vector<LitPoint> sample;  // about 4000 of the points, evenly along the scanner order
  long depth_range = 0;          // dropped: outside min_depth_mm..max_depth_mm
  long no_normal = 0;            // dropped: too few neighbours for a normal
  long steep = 0;                // dropped: seen under a too flat angle
  long projector = 0;            // dropped: the projector would have lit them by another column
  std::optional<double> median_projector_residual_px;  // only with a calibrated projector
};

// sigma_mm = Z^2 / (b f) * sigma of the disparity, times ray length over depth: along the view ray. Normals
// come from the gradient of the disparity (a plane's is constant) over (2 normal_radius_px + 1)^2 pixels,
// steps in depth left out. left: its coordinates, for the projector check. See docs/design.md, "Coordinate,
// and how sure" and "Stereo". Frames: see StereoRig.
Triangulation Triangulate(const DisparityMap& map, const RectifiedView& left, const StereoRig& rig,
                          const ReconstructionConfig& config);

}  // namespace forgescan
