// forgescan standing: what stands still about the part, from recorded scans of the empty cell.
#include <cstdio>
#include <memory>

#include "services/common/imaging/stereo_calibration.h"
#include "services/common/service/station.h"
#include "services/fusion/fusion_config.h"
#include "services/fusion/standing_file.h"
#include "services/fusion/visit_correction.h"
#include "services/reconstruction/reconstruction_service.h"
#include "tools/finite_range.h"
#include "tools/forgescan/command.h"
#include "tools/forgescan/standing/empty_scans.h"

namespace forgescan {
namespace {

struct Arguments {
  std::vector<std::string> logs;
  std::string station, out;
  std::vector<double> regions_mm;  // six a region
};

Result<std::vector<Eigen::AlignedBox3d>> RegionsOf(const std::vector<double>& numbers) {
  std::vector<Eigen::AlignedBox3d> regions;
  for (std::size_t i = 0; i + 6 <= numbers.size(); i += 6) {
    const Eigen::Vector3d low(numbers[i], numbers[i + 1], numbers[i + 2]);
    const Eigen::Vector3d high(numbers[i + 3], numbers[i + 4], numbers[i + 5]);
    if (!(low.array() < high.array()).all()) {
      return Fail(ErrorCode::kInvalidArgument, "--region {} {} {} {} {} {}: x0 y0 z0 must be below x1 y1 z1",
                  low.x(), low.y(), low.z(), high.x(), high.y(), high.z());
    }
    regions.emplace_back(low, high);
  }
  return regions;
}

void PrintCells(const StandingSurfaces& standing) {
  fmt::print("view  cells of what stands still, {} scans\n", standing.scans);
  for (std::size_t view = 0; view < standing.views.size(); ++view) {
    fmt::print("{:4}  {}\n", view, standing.views[view].size());
  }
}

Status Run(const Arguments& arguments) {
  if (!arguments.out.ends_with(".ply")) {
    return Fail(ErrorCode::kInvalidArgument, "--out {}: wanted is a file .ply", arguments.out);
  }
  ASSIGN_OR_RETURN(const std::vector<Eigen::AlignedBox3d> regions, RegionsOf(arguments.regions_mm));
  ASSIGN_OR_RETURN(const Station station, Station::Load(arguments.station));
  ASSIGN_OR_RETURN(const FusionConfig fusion, FusionConfig::Load(station.file.Table("fusion")));
  ASSIGN_OR_RETURN(VisitErrorOptions visit, VisitOptionsOf(fusion));
  ASSIGN_OR_RETURN(const auto reconstruction,
                   ReconstructionServiceConfig::Load(station.file.Table("reconstruction")));
  ASSIGN_OR_RETURN(const StereoCalibration calibration, LoadStereoCalibration(station.calibration));
  visit.cells.cell_rad =
      CellRadOf(calibration.left.camera_matrix(0, 0), reconstruction.publish_every_nth_point);
  ASSIGN_OR_RETURN(const ViewMatrices matrices, ViewMatrices::Load(station.views));
  StandingOrigin origin{matrices.path_crc32, 0};
  ASSIGN_OR_RETURN(origin.calibration_crc32, Crc32OfFile(station.calibration));
  ASSIGN_OR_RETURN(const auto scans, ReadEmptyScans(arguments.logs, origin));
  ASSIGN_OR_RETURN(const StandingSurfaces standing,
                   MakeStandingSurfaces(scans, {origin, matrices, regions, visit}));
  RETURN_IF_ERROR(WriteStandingSurfaces(arguments.out, standing));  // an old one stays if anything failed
  PrintCells(standing);
  return {};
}

}  // namespace

void AddStandingCommand(CLI::App& app, Status& outcome) {
  auto arguments = std::make_shared<Arguments>();
  CLI::App* command = app.add_subcommand(
      "standing", "What stands still about the part, from recorded scans of the empty cell");
  command->add_option("logs", arguments->logs, "recordings of scans without a part")->required();
  command->add_option("--station", arguments->station, "folder of the station")->required();
  command
      ->add_option("--region", arguments->regions_mm,
                   "x0 y0 z0 x1 y1 z1, array frame, mm: what stands still lies in one of the regions")
      ->required()
      ->type_size(6)
      ->check(FiniteRange(-10'000, 10'000));
  command->add_option("-o,--out", arguments->out, "file of standing surfaces, .ply")->required();
  command->callback([arguments, &outcome] { outcome = Run(*arguments); });
}

}  // namespace forgescan
