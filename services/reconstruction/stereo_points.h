// Two decoded views -> points with normals and predicted standard deviations.
#pragma once

#include <optional>
#include <vector>

#include "services/common/geometry/point_cloud.h"
#include "services/common/result.h"
#include "services/reconstruction/decoded_view.h"
#include "services/reconstruction/projector_consistency.h"
#include "services/reconstruction/reconstruction_config.h"
#include "services/reconstruction/stereo_rig.h"

namespace forgescan {

struct StereoCounts {
  // Left pixels with a coordinate on an epipolar line that fits their neighbours'; the following ones lost
  // it, in this order.
  long candidates = 0;
  long no_partner = 0;
  long ambiguous = 0;    // more than one place fits, or the coordinate occurs twice in the left row
  long left_right = 0;   // there and back does not close
  long depth_range = 0;  // outside min_depth_mm..max_depth_mm
  long no_normal = 0;    // too few neighbours for a normal
  long steep = 0;        // seen under a too flat angle
  long projector = 0;    // the projector would have lit them by another column
  long points = 0;       // what is left, kept or not
};

struct StereoPoints {
  PointCloud cloud_in_camera;    // scanner order: epipolar rows from the top, each from the left
  std::vector<LitPoint> sample;  // some 4000 of the points, evenly along the scanner order
  StereoCounts count;
  std::optional<double> median_projector_residual_px;  // only with a calibrated projector
  std::vector<PointCloud> spare;                       // memory of the threads, for the next call
};

// One point for every raw column of the left camera on every epipolar row: between two raw rows by linear
// interpolation, along the row smoothed by parabolas over five pixels of one surface. Its partner is found
// between two neighbours of the right row. No image is resampled. sigma_mm: along the view ray. Normals come
// from the gradient of the disparity over (2 normal_radius_px + 1)^2 pixels; points whose direct
// neighbours show a step in depth are left out, a step farther off in the window tilts the normal.
// keep_every_nth_point thins the cloud and nothing else. See docs/design.md, "Coordinate, and how sure" and
// "Stereo". Frames: see StereoRig. recycled: an earlier result nobody needs any more; fresh memory costs as
// much time as everything else. Errors: kInvalidArgument when the views are not of the rig's size;
// kDegenerate when a view has no coordinate at all, when its coordinate does not change along rows (fringes
// run the wrong way), or when the two views' coordinates run in opposite directions. Cost: tests/bench,
// "stereo"; memory beside the result: 0.7 MB a thread at 5 MP.
Result<StereoPoints> ComputeStereoPoints(const DecodedView& left, const DecodedView& right,
                                         const StereoRig& rig, const ReconstructionConfig& config,
                                         StereoPoints recycled = {});

}  // namespace forgescan
