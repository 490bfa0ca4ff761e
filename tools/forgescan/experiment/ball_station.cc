#include "tools/forgescan/experiment/ball_station.h"

#include "tools/virtual_station/scene.h"

namespace forgescan {
namespace {

constexpr int kVisitWithoutPair = 2'000'000;  // another one than any scan's

// Where a point of the scene lies in the array frame for one who takes the robot to be where it was taught.
Eigen::Vector3d SeenFrom(const ViewState& view, const CellConfig& config, const Eigen::Vector3d& p_in_array) {
  return TaughtRigPose(config.views.front(), config.working_distance_mm) *
         (view.array_from_rig.inverse() * p_in_array);
}

}  // namespace

BallStation::BallStation(const CellConfig& config, int threads, Scanner before, Scanner after,
                         BarRefinement bar)
    : cell_(config, threads), before_(std::move(before)), after_(std::move(after)), bar_(std::move(bar)) {}

Result<BallStation> BallStation::Create(const CellConfig& cell, const ExperimentOptions& options) {
  const CellConfig config = BallCell(cell);
  ASSIGN_OR_RETURN(const StationFiles before, Commission(config, options));
  ASSIGN_OR_RETURN(BarRefinement bar, RefineWithBar(config, before, options.threads));
  const StationFiles after = WithCalibration(before, config, bar.refinement.calibration);
  ASSIGN_OR_RETURN(Reconstructor reconstructor_before, MakeReconstructor(before, config));
  ASSIGN_OR_RETURN(Reconstructor reconstructor_after, MakeReconstructor(after, config));
  BallStation station(config, options.threads, {before, std::move(reconstructor_before)},
                      {after, std::move(reconstructor_after)}, std::move(bar));
  RETURN_IF_ERROR(station.ScanStanding());
  return station;
}

Status BallStation::ScanStanding() {
  const PartState nothing = BallPart({});
  ASSIGN_OR_RETURN(const ViewState at_rig, ColdView(cell_, nothing, kVisitWithoutPair));
  ASSIGN_OR_RETURN(const StereoImages images, TakeImages(cell_, nothing, ScatterAtTarget(at_rig, config())));
  ASSIGN_OR_RETURN(const Reconstruction result, after_.reconstructor.Run(images[0], images[1]));
  ASSIGN_OR_RETURN(const VisitErrorOptions visit, VisitOptionsOf(after_.files.fusion));
  visit_ = AgainstMeanOf(1, visit);
  standing_ = SurfaceCells(result.cloud_in_camera, visit_.cells);
  return {};
}

Result<BallVisit> BallStation::Scan(int visit) const {
  const BallPair placed = PairCenters(config());
  const PartState pair = BallPart(placed);
  ASSIGN_OR_RETURN(const ViewState at_rig, ColdView(cell_, pair, visit));
  const ViewState view = ScatterAtTarget(at_rig, config());
  ASSIGN_OR_RETURN(const StereoImages images, TakeImages(cell_, pair, view));
  ASSIGN_OR_RETURN(const Reconstruction before, before_.reconstructor.Run(images[0], images[1]));
  ASSIGN_OR_RETURN(const Reconstruction after, after_.reconstructor.Run(images[0], images[1]));
  BallVisit result;
  ASSIGN_OR_RETURN(result.before,
                   FindBalls(before.cloud_in_camera, placed, before_.files.views.array_from_camera.front()));
  const Eigen::Isometry3d& array_from_camera = after_.files.views.array_from_camera.front();
  ASSIGN_OR_RETURN(result.after, FindBalls(after.cloud_in_camera, placed, array_from_camera));
  ASSIGN_OR_RETURN(const VisitError error, EstimateVisitError(standing_, after.cloud_in_camera, visit_));
  for (std::size_t i = 0; i < 2; ++i) {
    result.taught[i] = array_from_camera * result.after[i].center;
    result.by_standing[i] = array_from_camera * (error.taught_from_actual * result.after[i].center);
    result.robot[i] = SeenFrom(view, config(), placed[i]);
    result.robot_at_rig[i] = SeenFrom(at_rig, config(), placed[i]);
  }
  return result;
}

}  // namespace forgescan
