// Where each view's camera truly stood, by the station's standing surfaces.
#pragma once

#include <string>

#include "services/fusion/fusion_config.h"
#include "services/fusion/standing_surfaces.h"

namespace forgescan {

struct CorrectedVisit {
  Eigen::Isometry3d taught_from_actual = Eigen::Isometry3d::Identity();  // camera frame, mm
  bool corrected = false;                                                // false: the view stays as taught
  std::size_t cells = 0;                                                 // seen when set up and now
  double shift_um = 0, turn_urad = 0;  // of the correction: at the middle of what the view sees, and in all
  std::string text;                    // all of it for a reader, one clause
};

// What the robot scatters and the limits, as [fusion] says. Errors: kInvalidArgument (it does not say).
Result<VisitErrorOptions> VisitOptionsOf(const FusionConfig& config);

class VisitCorrection {
 public:
  VisitCorrection(StandingSurfaces standing, const VisitErrorOptions& options);

  // Errors: those of EstimateVisitError. Cost: tests/bench/standing_bench.cc.
  Result<CorrectedVisit> Of(int view, const PointCloud& cloud_in_camera) const;

 private:
  StandingSurfaces standing_;
  VisitErrorOptions options_;
};

}  // namespace forgescan
