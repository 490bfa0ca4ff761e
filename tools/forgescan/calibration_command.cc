#include <cstdio>
#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>

#include "services/common/calibration/placements_file.h"
#include "services/common/imaging/stereo_calibration_text.h"
#include "services/common/input_file.h"
#include "services/common/output_file.h"
#include "services/fusion/standing_file.h"
#include "tools/finite_range.h"
#include "tools/forgescan/command.h"
#include "tools/forgescan/output_files.h"

namespace forgescan {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::json;

constexpr std::size_t kCheckPlacements = 7;  // VDI/VDE 2634 part 2

struct Arguments {
  std::string calibration, placements, out, json;
  double max_error_mm = 0;
};

struct Inputs {
  StereoCalibration calibration;
  PlacementsFile file;
  std::vector<BarPlacement> placements;
};

Result<PlacementsFile> ReadPlacementsFile(const fs::path& path) {
  ASSIGN_OR_RETURN(const std::string text, ReadInputFile(path));
  return ParsePlacements(text, path.string(), path.parent_path());
}

// Outputs must be none of the files that are read, clouds included.
std::vector<fs::path> PathsOf(const Arguments& arguments, const PlacementsFile& file) {
  std::vector<fs::path> paths = {arguments.calibration, arguments.placements};
  for (const PlacementEntry& entry : file.placements) {
    if (!entry.cloud.empty()) paths.push_back(entry.cloud);
  }
  return paths;
}

// Points of another calibration are off by both calibrations' errors, and nothing in them shows it.
Status CheckOrigin(const Arguments& arguments, const PlacementsFile& file) {
  if (!file.calibration_crc32) return {};
  ASSIGN_OR_RETURN(const std::uint32_t crc, Crc32OfFile(arguments.calibration));
  if (crc == *file.calibration_crc32) return {};
  return Fail(ErrorCode::kInvalidArgument,
              "{}: the placements were measured with the calibration of calibration_crc32 {}, {} has {}",
              arguments.placements, *file.calibration_crc32, arguments.calibration, crc);
}

Result<Inputs> ReadInputs(const Arguments& arguments, PlacementsFile file) {
  Inputs inputs;
  ASSIGN_OR_RETURN(inputs.calibration, LoadStereoCalibration(arguments.calibration));
  RETURN_IF_ERROR(CheckOrigin(arguments, file));
  inputs.file = std::move(file);
  ASSIGN_OR_RETURN(inputs.placements, MeasurePlacements(inputs.file));
  return inputs;
}

void PrintPlacements(const CalibrationRefinement& refinement) {
  std::printf("placement         error before   after   refined without it   its standard deviation, mm\n");
  for (const PlacementErrors& placement : refinement.placements) {
    std::printf("%-16s       %+8.4f %+8.4f             %+8.4f   %8.4f\n", placement.name.c_str(),
                placement.before_mm, placement.after_mm, placement.left_out_mm, placement.left_out_sigma_mm);
  }
  std::printf("largest                 %7.4f  %7.4f              %7.4f\n",
              LargestError(refinement.placements, &PlacementErrors::before_mm),
              LargestError(refinement.placements, &PlacementErrors::after_mm),
              LargestError(refinement.placements, &PlacementErrors::left_out_mm));
}

void PrintParameters(const CalibrationRefinement& refinement, const CalibrationPrior& prior) {
  const RigVector before = prior.StandardDeviations();
  std::printf("\nparameter        correction   standard deviation before   after\n");
  for (int i = 0; i < kRigParameters; ++i) {
    const RigParameter& parameter = RigParameters().at(static_cast<std::size_t>(i));
    std::printf("%-16s %+10.3g %10.3g                %10.3g %s\n", parameter.name, refinement.correction(i),
                before(i), refinement.posterior_sigma(i), parameter.unit);
  }
  const CertificateCorrection& certificate = refinement.certificate;
  std::printf("%-16s %+10.3g %10.3g                %10.3g mm\n", "certified length",
              certificate.correction_mm, certificate.prior_sigma_mm, certificate.sigma_mm);
  std::printf("directions the lengths determine: %d of %d\n", refinement.determined_directions,
              kRigParameters);
  if (refinement.projector) {
    std::printf("columns of the projector against the points: %.3f px rms, %.3f after it has followed\n",
                refinement.projector->rms_before_px, refinement.projector->rms_px);
  }
}

std::string JsonText(const CalibrationRefinement& refinement) {
  Json placements = Json::array(), parameters = Json::array(), motion = Json::array();
  for (const PlacementErrors& placement : refinement.placements) {
    placements.push_back({{"name", placement.name},
                          {"before_mm", placement.before_mm},
                          {"after_mm", placement.after_mm},
                          {"left_out_mm", placement.left_out_mm},
                          {"left_out_sigma_mm", placement.left_out_sigma_mm},
                          {"misfit_sigmas", placement.misfit_sigmas}});
  }
  for (int i = 0; i < kRigParameters; ++i) {
    const RigParameter& parameter = RigParameters().at(static_cast<std::size_t>(i));
    Json covariance = Json::array();
    for (int j = 0; j < kRigParameters; ++j) covariance.push_back(refinement.covariance(i, j));
    parameters.push_back({{"name", parameter.name},
                          {"unit", parameter.unit},
                          {"correction", refinement.correction(i)},
                          {"sigma", refinement.posterior_sigma(i)},
                          {"covariance", covariance}});
  }
  for (int i = 0; i < 16; ++i) motion.push_back(refinement.refined_from_present.matrix()(i / 4, i % 4));
  const CertificateCorrection& certificate = refinement.certificate;
  const Json json = {{"placements", placements},
                     {"certificate",
                      {{"correction_mm", certificate.correction_mm},
                       {"prior_sigma_mm", certificate.prior_sigma_mm},
                       {"sigma_mm", certificate.sigma_mm}}},
                     {"parameters", parameters},
                     {"determined_directions", refinement.determined_directions},
                     {"refined_from_present", motion}};
  return json.dump(2) + "\n";
}

Status Refine(const Arguments& arguments) {
  ASSIGN_OR_RETURN(PlacementsFile file, ReadPlacementsFile(arguments.placements));
  ASSIGN_OR_RETURN(const Inputs inputs, ReadInputs(arguments, std::move(file)));
  ASSIGN_OR_RETURN(
      const CalibrationRefinement refinement,
      RefineCalibration(inputs.calibration, inputs.file.bar, inputs.placements, inputs.file.options));
  // It removes what an earlier call wrote: not before there is something better.
  ASSIGN_OR_RETURN(auto outputs,
                   OutputFiles::Create(PathsOf(arguments, inputs.file), {arguments.out, arguments.json}));
  RETURN_IF_ERROR(
      WriteOutputFile(outputs.Staged(arguments.out), StereoCalibrationText(refinement.calibration)));
  if (!arguments.json.empty()) {
    RETURN_IF_ERROR(WriteOutputFile(outputs.Staged(arguments.json), JsonText(refinement)));
  }
  RETURN_IF_ERROR(outputs.Commit());
  PrintPlacements(refinement);
  PrintParameters(refinement, inputs.file.options.prior);
  return {};
}

Status CheckLengths(const Arguments& arguments) {
  ASSIGN_OR_RETURN(PlacementsFile file, ReadPlacementsFile(arguments.placements));
  ASSIGN_OR_RETURN(const Inputs inputs, ReadInputs(arguments, std::move(file)));
  PlacementRules rules = inputs.file.options.placements;
  rules.min_placements = kCheckPlacements;
  RETURN_IF_ERROR(CheckPlacements(inputs.file.bar, inputs.placements, inputs.calibration, rules));
  double largest_mm = 0;
  std::printf("placement         distance, mm   error, mm\n");
  for (const BarPlacement& placement : inputs.placements) {
    const double error_mm = placement.DistanceMm() - inputs.file.bar.distance_mm;
    largest_mm = std::max(largest_mm, std::abs(error_mm));
    std::printf("%-16s %12.4f    %+8.4f\n", placement.name.c_str(), placement.DistanceMm(), error_mm);
  }
  std::printf("sphere-spacing error SD: %.4f mm, limit %.4f mm\n", largest_mm, arguments.max_error_mm);
  if (largest_mm <= arguments.max_error_mm) return {};
  return Fail(ErrorCode::kUntrusted, "the sphere-spacing error is {:.4f} mm, allowed {:.4f} mm", largest_mm,
              arguments.max_error_mm);
}

void AddInputs(CLI::App& command, Arguments& arguments) {
  command
      .add_option("--calibration", arguments.calibration,
                  "stereo.yaml that the placements were measured with")
      ->required();
  command.add_option("--placements", arguments.placements, "the bar and its placements, TOML")->required();
}

}  // namespace

void AddCalibrationCommand(CLI::App& app, Status& outcome) {
  auto arguments = std::make_shared<Arguments>();
  CLI::App* command = app.add_subcommand("calibration", "Check or refine a calibration by a ball bar");
  command->require_subcommand(1);
  CLI::App* refine = command->add_subcommand("refine", "Refine a stereo calibration by certified lengths");
  AddInputs(*refine, *arguments);
  refine->add_option("--out", arguments->out, "the refined calibration to write, YAML")->required();
  refine->add_option("--json", arguments->json, "where to write errors, corrections and covariance");
  refine->callback([arguments, &outcome] { outcome = Refine(*arguments); });
  CLI::App* check = command->add_subcommand("check", "Sphere-spacing error of a ball bar, VDI/VDE 2634");
  AddInputs(*check, *arguments);
  check->add_option("--max-error-mm", arguments->max_error_mm, "largest error that is accepted")
      ->required()
      ->check(FiniteRange(0, 1000));
  check->callback([arguments, &outcome] { outcome = CheckLengths(*arguments); });
}

}  // namespace forgescan
