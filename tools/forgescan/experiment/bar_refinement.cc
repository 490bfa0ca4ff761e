#include "tools/forgescan/experiment/bar_refinement.h"

#include "tools/forgescan/experiment/draws.h"
#include "tools/virtual_station/teaching.h"

namespace forgescan {
namespace {

constexpr int kFirstBarVisit = 1'000'000;  // other visits than any scan of a part

// Of the cell's images against full ones.
double PixelScale(const CellConfig& config) {
  constexpr double kFullWidthPx = 2448;
  return config.rig.left.width_px / kFullWidthPx;
}

}  // namespace

CertifiedBar Certified(const CellConfig& config) {
  RandomStream random = DrawsOf(config.seed, Draw::kBarCertificate);
  CertifiedBar certified;
  certified.true_distance_mm = kBarDistanceMm + random.Uniform(-0.05, 0.05);
  certified.bar = {certified.true_distance_mm + 0.5 * kCertifiedMm * random.Gaussian(), 0.5 * kCertifiedMm,
                   kBallRadiusMm};
  return certified;
}

double CenterSigmaMm(const CellConfig& config) { return kFullCenterSigmaMm / PixelScale(config); }

Result<Reconstructor> MakeReconstructor(const StationFiles& files, const CellConfig& config) {
  return Reconstructor::Create(files.pattern, files.calibration,
                               {config.rig.left.width_px, config.rig.left.height_px},
                               files.reconstruction.reconstruction);
}

Result<std::array<FittedBall, 2>> FindBalls(const PointCloud& cloud_in_camera, const BallPair& placed,
                                            const Eigen::Isometry3d& array_from_camera) {
  std::array<FittedBall, 2> found;
  for (std::size_t i = 0; i < 2; ++i) {
    const BallSearch search{array_from_camera.inverse() * placed[i], Eigen::Vector3d::Zero(), kBallRadiusMm};
    const Result<FittedBall> ball = FitBall(cloud_in_camera, search);
    if (!ball.ok()) {
      return Fail(ball.error().code, "ball {} at {:.0f}, {:.0f}, {:.0f} mm in the camera's frame: {}", i + 1,
                  search.placed.x(), search.placed.y(), search.placed.z(), ball.error().message);
    }
    found[i] = *ball;
  }
  return found;
}

Result<ViewState> ColdView(const VirtualCell& cell, const PartState& part, int visit) {
  ASSIGN_OR_RETURN(ViewState view, cell.View(part, 0, 0, visit));
  view.part_degc = 20;
  view.scale = 1;
  return view;
}

RefinementOptions BarRefinementOptions(const CellConfig& config) {
  const double pixel_scale = PixelScale(config);
  RefinementOptions options;
  options.prior.focal_px *= pixel_scale;
  options.prior.center_px *= pixel_scale;
  options.placements.volume_mm = {240, 240, 160};
  return options;
}

StationFiles WithCalibration(StationFiles files, const CellConfig& config,
                             const StereoCalibration& calibration) {
  files.calibration = calibration;
  files.views.array_from_camera = TeachViews(config, WithCalibration(config.rig, calibration));
  return files;
}

Result<BarRefinement> RefineWithBar(const CellConfig& config, const StationFiles& files, int threads) {
  const VirtualCell cell(BarCell(config), threads);
  const StationFiles station = WithCalibration(files, cell.config(), files.calibration);
  ASSIGN_OR_RETURN(const Reconstructor reconstructor, MakeReconstructor(station, config));
  BarRefinement result{Certified(config), {}};
  std::vector<BarPlacement> placements;
  for (const BallPair& placed : BarPlacements(cell.config(), result.certified.true_distance_mm)) {
    const int number = static_cast<int>(placements.size());
    const PartState bar = BallPart(placed);
    ASSIGN_OR_RETURN(const ViewState view, ColdView(cell, bar, kFirstBarVisit + number));
    ASSIGN_OR_RETURN(const StereoImages images, TakeImages(cell, bar, view));
    ASSIGN_OR_RETURN(const Reconstruction scan, reconstructor.Run(images[0], images[1]));
    ASSIGN_OR_RETURN(const auto balls,
                     FindBalls(scan.cloud_in_camera, placed, station.views.array_from_camera.front()));
    placements.push_back(
        {fmt::format("{}", number + 1), {balls[0].center, balls[1].center}, CenterSigmaMm(config)});
  }
  ASSIGN_OR_RETURN(result.refinement, RefineCalibration(station.calibration, result.certified.bar, placements,
                                                        BarRefinementOptions(config)));
  return result;
}

}  // namespace forgescan
