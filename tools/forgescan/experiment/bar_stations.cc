#include "tools/forgescan/experiment/bar_stations.h"

#include "tools/forgescan/experiment/bar_refinement.h"
#include "tools/forgescan/experiment/draws.h"
#include "tools/virtual_station/teaching.h"

namespace forgescan {
namespace {

double ErrorOf(const StereoCalibration& calibration, const CellConfig& config) {
  const BallPair seen = SeenBy(calibration, config, PairCenters(config));
  return std::abs((seen[1] - seen[0]).norm() - kBallDistanceMm);
}

std::vector<BarPlacement> MeasureBar(const StereoCalibration& calibration, const CellConfig& config,
                                     double true_distance_mm) {
  const double sigma_mm = CenterSigmaMm(config);
  RandomStream random = DrawsOf(config.seed, Draw::kBarCenters);
  std::vector<BarPlacement> placements;
  for (const BallPair& placed : BarPlacements(config, true_distance_mm)) {
    BallPair seen = SeenBy(calibration, config, placed);
    for (Eigen::Vector3d& center : seen) {
      for (double& coordinate : center) coordinate += sigma_mm * random.Gaussian();
    }
    placements.push_back({fmt::format("{}", placements.size() + 1), seen, sigma_mm});
  }
  return placements;
}

}  // namespace

BarStations RefineStations(CellConfig config, int stations, double limit_mm) {
  const RefinementOptions options = BarRefinementOptions(config);
  BarStations result;
  for (int station = 1; station <= stations; ++station) {
    config.seed = static_cast<std::uint64_t>(station);
    const StereoCalibration calibration = CalibrationOf(CalibratedRig(config));
    CertifiedBar certified = Certified(config);
    certified.bar.ball_radius_mm = 0;  // rays show centres, not surfaces
    const auto refinement = RefineCalibration(
        calibration, certified.bar, MeasureBar(calibration, config, certified.true_distance_mm), options);
    result.within_before += ErrorOf(calibration, config) <= limit_mm ? 1.0 / stations : 0;
    if (!refinement.ok()) {
      result.refused += 1.0 / stations;
      continue;
    }
    result.within_after += ErrorOf(refinement->calibration, config) <= limit_mm ? 1.0 / stations : 0;
  }
  return result;
}

}  // namespace forgescan
