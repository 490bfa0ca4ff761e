#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>

#include "services/common/geometry/cloud_io.h"
#include "services/common/model/model_import.h"
#include "services/common/output_file.h"
#include "services/registration/classify.h"
#include "services/registration/icp.h"
#include "services/registration/pose_search.h"
#include "tools/forgescan/command.h"
#include "tools/forgescan/output_files.h"
#include "tools/forgescan/text_output.h"

namespace forgescan {
namespace {

struct Arguments {
  std::string scan, model, initial, out, json;
  bool search = false;
  ModelImportOptions import;
  IcpOptions icp;
  ClassifyOptions classify;
};

nlohmann::json Matrix(const Eigen::Ref<const Eigen::MatrixXd>& m) {
  nlohmann::json rows = nlohmann::json::array();
  for (Eigen::Index i = 0; i < m.rows(); ++i) {
    rows.push_back(std::vector<double>());
    for (Eigen::Index j = 0; j < m.cols(); ++j) rows.back().push_back(m(i, j));
  }
  return rows;
}

nlohmann::json WeakDirections(const Registration& r) {
  nlohmann::json list = nlohmann::json::array();
  for (const auto& weak : r.weak_directions)
    list.push_back({{"motion", weak.name}, {"eigenvalue", weak.eigenvalue}});
  return list;
}

std::string Json(const Registration& r, const CloudFromFile& scan, std::size_t part_points) {
  const nlohmann::json json = {{"model_from_scan", Matrix(r.model_from_scan.matrix())},
                               {"iterations", r.iterations},
                               {"considered", r.considered},
                               {"inliers", r.inliers},
                               {"inlier_share", r.inlier_share},
                               {"threshold_mm", r.threshold_mm},
                               {"rms_mm", r.rms_mm},
                               {"capped_score_mm", r.capped_score_mm},
                               {"weakest_eigenvalue", r.weakest_eigenvalue},
                               {"weak_directions", WeakDirections(r)},
                               // JSON has no infinity: null says that there is no rival.
                               {"rival_ratio", r.rival_ratio},
                               {"correction_mm", r.correction_mm},
                               {"correction_rad", r.correction_rad},
                               {"covariance_rad_mm", Matrix(r.covariance)},
                               {"center_mm", {r.center.x(), r.center.y(), r.center.z()}},
                               {"points", scan.size()},
                               {"not_finite", scan.not_finite},
                               {"part_points", part_points}};
  return json.dump(2) + "\n";
}

std::vector<std::filesystem::path> Inputs(const Arguments& arguments) {
  std::vector<std::filesystem::path> inputs = {arguments.scan, arguments.model};
  if (!arguments.initial.empty()) inputs.emplace_back(arguments.initial);
  return inputs;
}

Status Run(const Arguments& arguments) {
  ASSIGN_OR_RETURN(auto outputs, OutputFiles::Create(Inputs(arguments), {arguments.out, arguments.json}));
  ASSIGN_OR_RETURN(const ModelBundle bundle, LoadModel(arguments.model, arguments.import));
  ASSIGN_OR_RETURN(const RegistrationModel model, RegistrationModel::Build(bundle));
  ASSIGN_OR_RETURN(const CloudFromFile scan, ReadPointCloud(arguments.scan));
  Eigen::Isometry3d start = Eigen::Isometry3d::Identity();
  if (!arguments.initial.empty()) {
    ASSIGN_OR_RETURN(start, ReadPose(arguments.initial));
  }
  ASSIGN_OR_RETURN(const Registration result, arguments.search
                                                  ? SearchPose(scan, model, arguments.icp)
                                                  : RegisterScan(scan, model, start, arguments.icp));
  const auto part = FindPartPoints(scan, model, result.model_from_scan, arguments.classify);
  if (!arguments.json.empty()) {
    RETURN_IF_ERROR(WriteOutputFile(outputs.Staged(arguments.json), Json(result, scan, part.size())));
  }
  RETURN_IF_ERROR(WriteOutputFile(outputs.Staged(arguments.out), PoseText(result.model_from_scan)));
  return outputs.Commit();
}

}  // namespace

void AddRegisterCommand(CLI::App& app, Status& outcome) {
  auto arguments = std::make_shared<Arguments>();
  CLI::App* command =
      app.add_subcommand("register", "Find the pose of a part in a scan, by its design model");
  command->add_option("--scan", arguments->scan, "scan, PLY or PCD, mm")->required();
  command->add_option("--model", arguments->model, "design model: .step, .stl, .ply or .bundle")->required();
  CLI::Option* initial = command->add_option("--initial", arguments->initial,
                                             "model_from_scan to start from, 4 x 4 (default: identity)");
  command->add_flag("--search", arguments->search, "however the part lies: without a start")
      ->excludes(initial);
  command->add_option("--out", arguments->out, "where to write model_from_scan, 4 x 4, row-major, mm")
      ->required();
  command->add_option("--json", arguments->json, "where to write pose, quality and covariance");
  command->add_option("--spacing-mm", arguments->import.spacing_mm, "of the model samples")
      ->capture_default_str();
  command
      ->add_option("--start-translation-mm", arguments->icp.start_translation_mm,
                   "how far the start may be off")
      ->capture_default_str();
  command
      ->add_option("--start-rotation-rad", arguments->icp.start_rotation_rad,
                   "how far the start may be turned")
      ->capture_default_str();
  command->add_option("--threshold-sigmas", arguments->icp.threshold_sigmas, "a of Eq. (6)")
      ->capture_default_str();
  command->add_option("--threshold-floor-mm", arguments->icp.threshold_floor_mm, "least distance threshold")
      ->capture_default_str();
  command->add_option("--min-inlier-share", arguments->icp.min_inlier_share, "of the points about the model")
      ->capture_default_str();
  command
      ->add_option("--rival-ratio", arguments->icp.rival_ratio,
                   "refuse when another pose scores below so many times this one; 0: do not look")
      ->capture_default_str();
  command->add_option("--threads", arguments->icp.threads, "0: all")->capture_default_str();
  command->callback([arguments, &outcome] {
    arguments->classify.threads = arguments->icp.threads;
    outcome = Run(*arguments);
  });
}

}  // namespace forgescan
