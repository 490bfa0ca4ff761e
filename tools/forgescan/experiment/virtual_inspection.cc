#include "tools/forgescan/experiment/virtual_inspection.h"

#include <filesystem>

#include "services/common/input_file.h"
#include "services/common/model/model_import.h"
#include "services/common/output_file.h"
#include "services/common/service/station.h"
#include "services/registration/classify.h"
#include "services/registration/icp.h"
#include "services/report/report_config.h"
#include "tools/forgescan/replay/scratch_folder.h"
#include "tools/virtual_station/commissioning.h"
#include "tools/virtual_station/scene.h"
#include "tools/virtual_station/station_writer.h"

namespace forgescan {
namespace {

namespace fs = std::filesystem;

Result<StationFiles> LoadFiles(const std::string& folder, int threads) {
  ASSIGN_OR_RETURN(const Station station, Station::Load(folder));
  StationFiles files;
  ASSIGN_OR_RETURN(files.reconstruction,
                   ReconstructionServiceConfig::Load(station.file.Table("reconstruction")));
  ASSIGN_OR_RETURN(files.fusion, FusionConfig::Load(station.file.Table("fusion")));
  ASSIGN_OR_RETURN(files.registration, RegistrationConfig::Load(station.file.Table("registration")));
  ASSIGN_OR_RETURN(const ReportConfig report, ReportConfig::Load(station.file.Table("report")));
  files.dimensions = report.dimensions;
  files.reconstruction.reconstruction.threads = threads;
  files.registration.icp.threads = files.registration.classify.threads = static_cast<unsigned>(threads);
  files.dimensions.select.threads = static_cast<unsigned>(threads);
  ASSIGN_OR_RETURN(files.pattern, LoadPatternSet(station.pattern));
  ASSIGN_OR_RETURN(files.calibration, LoadStereoCalibration(station.calibration));
  ASSIGN_OR_RETURN(files.views, ViewMatrices::Load(station.views));
  ASSIGN_OR_RETURN(files.model, LoadModel(fs::path(folder) / "model/axle.step", {}));
  ASSIGN_OR_RETURN(files.features, LoadFeatures(station.features));
  return files;
}

PointCloud PartInModel(const PointCloud& cloud, const std::vector<std::uint32_t>& part,
                       const Eigen::Isometry3d& model_from_array) {
  PointCloud moved;
  for (const std::uint32_t i : part) {
    moved.points.push_back((model_from_array * cloud.points[i].cast<double>()).cast<float>());
    moved.normals.push_back((model_from_array.linear() * cloud.normals[i].cast<double>()).cast<float>());
    moved.sigma_mm.push_back(cloud.sigma_mm[i]);
    moved.view.push_back(cloud.view[i]);
  }
  return moved;
}

}  // namespace

Result<CellConfig> LoadExperimentCell(const ExperimentOptions& options) {
  ASSIGN_OR_RETURN(CellConfig config, LoadCellConfig(options.cell, options.scale_divisor));
  config.seed = options.seed;
  return config;
}

Result<StationFiles> Commission(const CellConfig& config, const ExperimentOptions& options) {
  ASSIGN_OR_RETURN(const ScratchFolder scratch, ScratchFolder::Make());
  RETURN_IF_ERROR(WriteStation(config, ProjectedSet::kReduced, scratch.path().string()));
  ASSIGN_OR_RETURN(const std::string text, ReadInputFile(fs::path(options.station) / "station.toml"));
  ASSIGN_OR_RETURN(const std::string commissioned, CommissionedStation(config, text));
  RETURN_IF_ERROR(WriteOutputFile(scratch.path() / "station.toml", commissioned));
  return LoadFiles(scratch.path().string(), options.threads);
}

std::vector<cv::Mat> ExposeAll(const GeometryMap& map, const CellConfig& config,
                               const std::vector<Pattern>& patterns, ImageKey key, int threads) {
  std::vector<cv::Mat> images;
  for (const Pattern& pattern : patterns) {
    key.pattern = static_cast<int>(images.size());
    const std::vector<std::uint8_t> grey =
        ExposeImage(map, {config.projector_light, config.sensor, pattern, key, threads});
    cv::Mat_<std::uint8_t> image(map.height, map.width);
    std::copy(grey.begin(), grey.end(), image.begin());
    images.push_back(image);
  }
  return images;
}

Result<VirtualInspection> VirtualInspection::Create(CellConfig config, const ExperimentOptions& options) {
  ASSIGN_OR_RETURN(StationFiles files, Commission(config, options));
  return Create(std::move(config), std::move(files), options.threads);
}

Result<VirtualInspection> VirtualInspection::Create(CellConfig config, StationFiles station, int threads) {
  VirtualInspection inspection;
  inspection.files_ = std::move(station);
  const StationFiles& files = inspection.files_;
  const ImageSize size{config.rig.left.width_px, config.rig.left.height_px};
  ReconstructionConfig reconstruction = files.reconstruction.reconstruction;
  reconstruction.keep_every_nth_point = files.reconstruction.publish_every_nth_point;
  ASSIGN_OR_RETURN(Reconstructor reconstructor,
                   Reconstructor::Create(files.pattern, files.calibration, size, reconstruction));
  inspection.reconstructor_ = std::make_shared<const Reconstructor>(std::move(reconstructor));
  ASSIGN_OR_RETURN(RegistrationModel model, RegistrationModel::Build(files.model));
  inspection.model_ = std::make_shared<const RegistrationModel>(std::move(model));
  ASSIGN_OR_RETURN(auto evaluator, ModelEvaluator::Make(files.model, files.features, files.dimensions));
  inspection.evaluator_ = std::move(evaluator);
  inspection.cell_ = std::make_shared<const VirtualCell>(std::move(config), threads);
  return inspection;
}

Result<InspectedPart> VirtualInspection::Measure(const std::vector<ViewCloud>& views,
                                                 const ViewMatrices& matrices) const {
  const FusionConfig& fusion = files_.fusion;
  ASSIGN_OR_RETURN(const ExpansionCurve curve,
                   ExpansionCurve::Create(fusion.expansion_degc, fusion.expansion));
  const auto& fixed = fusion.fixed_point_mm;
  ASSIGN_OR_RETURN(
      const FusedCloud fused,
      FuseViews(views, matrices, curve, {fusion.reference_temperature_degc, {fixed[0], fixed[1], fixed[2]}}));
  const RegistrationConfig& config = files_.registration;
  ASSIGN_OR_RETURN(const Registration registration,
                   RegisterScan(fused.cloud_in_array, *model_, config.model_from_array, config.icp));
  const auto part =
      FindPartPoints(fused.cloud_in_array, *model_, registration.model_from_scan, config.classify);
  InspectedPart inspected;
  ASSIGN_OR_RETURN(inspected.dimensions, evaluator_->Evaluate(PartInModel(fused.cloud_in_array, part,
                                                                          registration.model_from_scan)));
  inspected.registration_rms_mm = registration.rms_mm;
  inspected.points = fused.cloud_in_array.size();
  inspected.part_points = part.size();
  return inspected;
}

Result<VisitCorrection> VirtualInspection::Correction(const PartState& part,
                                                      const std::vector<ViewState>& views) const {
  ASSIGN_OR_RETURN(VisitErrorOptions visit, VisitOptionsOf(files_.fusion));
  visit.cells.cell_rad =
      CellRadOf(files_.calibration.left.camera_matrix(0, 0), files_.reconstruction.publish_every_nth_point);
  std::vector<std::vector<ViewCloud>> scans(1);
  ASSIGN_OR_RETURN(scans[0], ScanEmptyCell(*cell_, *reconstructor_, part, views));
  const auto regions = PostRegions(config().posts);
  ASSIGN_OR_RETURN(StandingSurfaces standing,
                   MakeStandingSurfaces(scans, {{}, files_.views, regions, visit}));
  return VisitCorrection(std::move(standing), visit);
}

ViewState ScatterAtTarget(const ViewState& view, const CellConfig& config) {
  const Eigen::Translation3d to_target(0, 0, config.working_distance_mm);
  ViewState moved = view;
  moved.taught_from_actual = to_target * view.taught_from_actual * to_target.inverse();
  moved.array_from_rig = view.array_from_rig * view.taught_from_actual.inverse() * moved.taught_from_actual;
  return moved;
}

ViewMatrices WithoutRobot(const ViewMatrices& matrices, const std::vector<ViewState>& views,
                          const CellConfig& config) {
  ViewMatrices corrected = matrices;
  for (const ViewState& view : views) {
    const auto index = static_cast<std::size_t>(view.view);
    const Eigen::Isometry3d taught = TaughtRigPose(config.views[index], config.working_distance_mm);
    Eigen::Isometry3d& matrix = corrected.array_from_camera[index];
    matrix = taught * view.taught_from_actual * taught.inverse() * matrix;
  }
  return corrected;
}

}  // namespace forgescan
