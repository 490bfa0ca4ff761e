#include "tools/forgescan/standing/empty_cell.h"

#include <numbers>

#include "services/common/imaging/stereo_calibration.h"
#include "services/common/service/station.h"
#include "services/fusion/standing_file.h"
#include "services/fusion/visit_correction.h"
#include "services/reconstruction/pattern_set.h"
#include "services/reconstruction/reconstruction_service.h"

namespace forgescan {
namespace {

constexpr double kOutOfSightMm = 30'000;
constexpr double kRegionMarginMm = 20;

std::vector<cv::Mat> Expose(const VirtualCell& cell, const GeometryMap& map, const ViewState& view,
                            Side side) {
  std::vector<cv::Mat> images;
  for (const Pattern& pattern : cell.Patterns(ProjectedSet::kReduced)) {
    const std::vector<std::uint8_t> grey =
        cell.Image(map, view, side, pattern, static_cast<int>(images.size()));
    cv::Mat_<std::uint8_t> image(map.height, map.width);
    std::copy(grey.begin(), grey.end(), image.begin());
    images.push_back(image);
  }
  return images;
}

// What a station computes points with.
struct Scanner {
  StereoCalibration calibration;
  int every_nth_point;
  Reconstructor reconstructor;
};

Result<Scanner> LoadScanner(const Station& station, const Rig& rig, int threads) {
  ASSIGN_OR_RETURN(auto service, ReconstructionServiceConfig::Load(station.file.Table("reconstruction")));
  ASSIGN_OR_RETURN(const PatternSet pattern, LoadPatternSet(station.pattern));
  ASSIGN_OR_RETURN(const StereoCalibration calibration, LoadStereoCalibration(station.calibration));
  service.reconstruction.threads = threads;
  service.reconstruction.keep_every_nth_point = service.publish_every_nth_point;
  ASSIGN_OR_RETURN(Reconstructor reconstructor,
                   Reconstructor::Create(pattern, calibration, {rig.left.width_px, rig.left.height_px},
                                         service.reconstruction));
  return Scanner{calibration, service.publish_every_nth_point, std::move(reconstructor)};
}

// Each view of the first part's scan, at a visit of its own.
Result<std::vector<ViewState>> ViewsWithoutPart(const VirtualCell& cell, const PartState& part) {
  std::vector<ViewState> views;
  for (int view = 0; view < static_cast<int>(cell.config().views.size()); ++view) {
    ASSIGN_OR_RETURN(const ViewState state, cell.View(part, view, 0, kVisitWithoutPart));
    views.push_back(state);
  }
  return views;
}

}  // namespace

Result<StereoImages> TakeImages(const VirtualCell& cell, const PartState& part, const ViewState& view) {
  StereoImages images;
  for (const Side side : {Side::kLeft, Side::kRight}) {
    ASSIGN_OR_RETURN(const GeometryMap map, cell.Map(part, view, side));
    images[static_cast<std::size_t>(side)] = Expose(cell, map, view, side);
  }
  return images;
}

Result<ViewCloud> ScanView(const VirtualCell& cell, const Reconstructor& reconstructor, const PartState& part,
                           const ViewState& view) {
  ASSIGN_OR_RETURN(const StereoImages images, TakeImages(cell, part, view));
  auto result = reconstructor.Run(images[0], images[1]);
  if (!result.ok()) {
    return Fail(result.error().code, "visit {}, view {}: {}", view.visit, view.view, result.error().message);
  }
  return ViewCloud{view.view, view.pyrometer_degc, std::move(result->cloud_in_camera)};
}

Result<std::vector<ViewCloud>> ScanEmptyCell(const VirtualCell& cell, const Reconstructor& reconstructor,
                                             PartState part, const std::vector<ViewState>& views) {
  part.array_from_part.translation().x() += kOutOfSightMm;
  std::vector<ViewCloud> scan;
  for (const ViewState& view : views) {
    Result<ViewCloud> cloud = ScanView(cell, reconstructor, part, view);
    if (cloud.ok()) {
      scan.push_back(std::move(*cloud));
    } else if (cloud.error().code != ErrorCode::kUntrusted && cloud.error().code != ErrorCode::kDegenerate) {
      return cloud.error();
    }
  }
  return scan;
}

std::vector<Eigen::AlignedBox3d> PostRegions(const std::vector<PostConfig>& posts) {
  std::vector<Eigen::AlignedBox3d> regions;
  for (const PostConfig& post : posts) {
    const double reach_mm = post.width_mm / std::numbers::sqrt2 + kRegionMarginMm;
    const Eigen::Vector3d low(post.top_mm.x() - reach_mm, post.top_mm.y() - reach_mm, post.foot_z_mm);
    regions.emplace_back(low, post.top_mm + Eigen::Vector3d(reach_mm, reach_mm, kRegionMarginMm));
  }
  return regions;
}

Status WriteStandingOf(const CellConfig& config, const std::string& folder, int threads) {
  ASSIGN_OR_RETURN(const Station station, Station::Load(folder));
  if (station.standing.empty()) {
    return {};
  }
  ASSIGN_OR_RETURN(const FusionConfig fusion, FusionConfig::Load(station.file.Table("fusion")));
  ASSIGN_OR_RETURN(VisitErrorOptions visit, VisitOptionsOf(fusion));
  ASSIGN_OR_RETURN(const ViewMatrices matrices, ViewMatrices::Load(station.views));
  StandingOrigin origin{matrices.path_crc32, 0};
  ASSIGN_OR_RETURN(origin.calibration_crc32, Crc32OfFile(station.calibration));
  ASSIGN_OR_RETURN(const Scanner scanner, LoadScanner(station, config.rig, threads));
  visit.cells.cell_rad = CellRadOf(scanner.calibration.left.camera_matrix(0, 0), scanner.every_nth_point);
  const VirtualCell cell(config, threads);
  ASSIGN_OR_RETURN(const PartState part, cell.Part(0));
  ASSIGN_OR_RETURN(const auto views, ViewsWithoutPart(cell, part));
  std::vector<std::vector<ViewCloud>> scans(1);
  ASSIGN_OR_RETURN(scans[0], ScanEmptyCell(cell, scanner.reconstructor, part, views));
  const auto regions = PostRegions(config.posts);
  ASSIGN_OR_RETURN(const StandingSurfaces standing,
                   MakeStandingSurfaces(scans, {origin, matrices, regions, visit}));
  return WriteStandingSurfaces(station.standing, standing);
}

}  // namespace forgescan
