// The virtual station's calibration, refined by a ball bar that is scanned at many places.
#pragma once

#include "services/common/calibration/refine_calibration.h"
#include "services/common/features/ball_fit.h"
#include "tools/forgescan/experiment/ball_scene.h"
#include "tools/forgescan/experiment/virtual_inspection.h"

namespace forgescan {

// What is known of the bar's measurement: U of its certificate with k = 2, the standard deviation of a
// coordinate of a centre in full images, mm.
inline constexpr double kCertifiedMm = 0.001;
inline constexpr double kFullCenterSigmaMm = 0.003;

// What the certificate says, and the truth.
struct CertifiedBar {
  BallBar bar;
  double true_distance_mm = 0;
};

struct BarRefinement {
  CertifiedBar certified;
  CalibrationRefinement refinement;
};

// The station's bar: another length and another error of the certificate for each seed.
CertifiedBar Certified(const CellConfig& config);

// Standard deviation of a coordinate of a centre in the cell's images, mm.
double CenterSigmaMm(const CellConfig& config);

// The bar in front of this station's cameras, with images as always, its centres as any station measures
// them, and RefineCalibration. config: any cell with the station's rig and seed. Errors: those of the steps.
Result<BarRefinement> RefineWithBar(const CellConfig& config, const StationFiles& files, int threads);

// The station with another calibration, its views taught anew with it.
StationFiles WithCalibration(StationFiles files, const CellConfig& config,
                             const StereoCalibration& calibration);

Result<Reconstructor> MakeReconstructor(const StationFiles& files, const CellConfig& config);

// placed: in the array frame, as far as the one who put them there knows.
Result<std::array<FittedBall, 2>> FindBalls(const PointCloud& cloud_in_camera, const BallPair& placed,
                                            const Eigen::Isometry3d& array_from_camera);

// The robot's visit with cold parts.
Result<ViewState> ColdView(const VirtualCell& cell, const PartState& part, int visit);

// The refinement's default prior, for the cell's image size, and the volume of BarPlacements.
RefinementOptions BarRefinementOptions(const CellConfig& config);

}  // namespace forgescan
