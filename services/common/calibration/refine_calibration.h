// A stereo calibration refined in the field by a certified length.
#pragma once

#include <Eigen/Geometry>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "services/common/calibration/placement_checks.h"
#include "services/common/calibration/projector_refit.h"
#include "services/common/calibration/rig_parameters.h"

namespace forgescan {

struct RefinementOptions {
  CalibrationPrior prior;
  PlacementRules placements;
  double max_misfit_sigmas = 4;  // of a placement against what the others predict
  double max_prior_sigmas = 3;   // of a correction
};

// Measured less certified distance, the latter as the certificate has it. Units: mm.
struct PlacementErrors {
  std::string name;
  double before_mm = 0;
  double after_mm = 0;           // with the calibration that this placement helped to refine
  double left_out_mm = 0;        // with one refined without it
  double left_out_sigma_mm = 0;  // by the noise, the refinement without it and the certificate
  // Of left_out_mm less the certificate's correction as the others have it, over its own standard deviation.
  double misfit_sigmas = 0;
};

// Of the certified distance. Units: mm.
struct CertificateCorrection {
  double correction_mm = 0;  // estimated distance less certified
  double prior_sigma_mm = 0;
  double sigma_mm = 0;  // after the refinement
};

struct CalibrationRefinement {
  StereoCalibration calibration;
  RigVector correction;           // refined less present, units of RigParameters()
  RigVector posterior_sigma;      // of the refined parameters
  RigMatrix covariance;           // the same with what they share; only lengths are known well
  int determined_directions = 0;  // of the 16: those known twice as well as before
  CertificateCorrection certificate;
  std::vector<PlacementErrors> placements;
  // Where the present calibration's camera frame lies in the refined one's: the rigid motion nearest to how
  // points of the volume move. Views taught before take array_from_camera * its inverse.
  Eigen::Isometry3d refined_from_present = Eigen::Isometry3d::Identity();
  std::optional<ProjectorRefit> projector;
};

// Sphere-spacing error of the placements, VDI/VDE 2634: the largest absolute error.
double LargestError(std::span<const PlacementErrors> placements, double PlacementErrors::*error);

// Purpose: the parameters of a rig whose lengths come nearest to the certified one wherever the bar stood.
// Method: each ball is seen by both cameras as the present calibration says, on the part of its surface
// within 60 degrees of the view, and measured anew by the corrected one, its centre with the known radius.
// Least squares over 16 corrections and the certificate's own error, each with its prior standard deviation:
// what no length shows stays where it was. A placement's error without it follows from its leverage.
// The projector follows (projector_refit.h). Source: VDI/VDE 2634 parts 2 and 3 (sphere spacing); Luhmann et
// al., Close-Range Photogrammetry and 3D Imaging (scale bars in the adjustment).
// Frames: camera = rectified left camera, of the present calibration for what goes in. Shape of the results:
// as the placements. Deterministic. Errors: those of CheckPlacements and Check(prior); kUntrusted if a
// placement contradicts the others (named), if all scatter more than their standard deviations say, or if a
// correction is beyond its prior; kNotConverged.
Result<CalibrationRefinement> RefineCalibration(const StereoCalibration& present, const BallBar& bar,
                                                std::span<const BarPlacement> placements,
                                                const RefinementOptions& options);

}  // namespace forgescan
