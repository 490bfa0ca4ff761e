// forgescan reconstruct: image files of one view -> cloud.ply and, on request, what is known about its
// quality.
#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <thread>
#include <vector>

#include "services/common/geometry/cloud_io.h"
#include "services/common/output_file.h"
#include "services/reconstruction/reconstruct.h"
#include "tools/forgescan/command.h"
#include "tools/forgescan/frame_file.h"
#include "tools/forgescan/output_files.h"

namespace forgescan {
namespace {

struct ReconstructArguments {
  std::string left;
  std::string right;
  std::string calibration;
  std::string pattern;
  std::string out;
  std::string json;
  ReconstructionConfig config;
};

Result<std::vector<cv::Mat>> ReadFrames(const std::filesystem::path& directory, const PatternSet& pattern) {
  std::vector<cv::Mat> frames;
  for (const std::string& name : pattern.frame_names) {
    ASSIGN_OR_RETURN(auto frame, ReadFrame(directory / name));
    frames.push_back(std::move(frame));
  }
  return frames;
}

nlohmann::json ToJson(const CameraQuality& quality) {
  nlohmann::json pixels;
  for (int cause = 0; cause < kMaskCauses; ++cause) {
    pixels[std::string(NameOf(static_cast<MaskCause>(cause)))] =
        quality.pixels[static_cast<std::size_t>(cause)];
  }
  const auto number = [](const std::optional<double>& value) {
    return value ? nlohmann::json(*value) : nlohmann::json(nullptr);
  };
  return {{"pixels", pixels},
          {"repaired", quality.repaired},
          {"clipping_dn", number(quality.clipping_dn)},
          {"median_modulation_dn", quality.median_modulation_dn},
          {"median_sigma_px", quality.median_sigma_px},
          {"measured_noise_dn", number(quality.trust.noise_dn)},
          {"disagreement_rad", quality.trust.disagreement_rad},
          {"predicted_disagreement_rad", quality.trust.predicted_disagreement_rad},
          {"saturated_fraction", quality.trust.saturated_fraction},
          {"uncut_reference_fraction", number(quality.trust.uncut_reference_fraction)},
          {"drift_dn", number(quality.trust.drift_dn)},
          {"drift_phase_rad", number(quality.trust.drift_phase_rad)},
          {"second_harmonic_ratio", number(quality.trust.second_harmonic_ratio)},
          {"suspected_second_harmonic", number(quality.trust.suspected_second_harmonic)}};
}

nlohmann::json ToJson(const Reconstruction& reconstruction) {
  const ReconstructionQuality& quality = reconstruction.quality;
  nlohmann::json json = {{"points", reconstruction.cloud_in_camera.size()},
                         {"median_sigma_mm", quality.median_sigma_mm},
                         {"candidates", quality.stereo.candidates},
                         {"dropped",
                          {{"no_partner", quality.stereo.no_partner},
                           {"ambiguous", quality.stereo.ambiguous},
                           {"left_right", quality.stereo.left_right},
                           {"depth_range", quality.stereo.depth_range},
                           {"no_normal", quality.stereo.no_normal},
                           {"steep", quality.stereo.steep},
                           {"projector", quality.stereo.projector}}},
                         {"left", ToJson(quality.left)},
                         {"right", ToJson(quality.right)}};
  if (quality.median_projector_residual_px) {
    json["median_projector_residual_px"] = *quality.median_projector_residual_px;
  }
  if (const auto& figures = quality.projector_consistency) {
    json["projector_consistency"] = {{"column_rms_px", figures->column_rms_px},
                                     {"flat_column_rms_px", figures->flat_column_rms_px},
                                     {"flat_parallax_px", figures->flat_parallax_px}};
  }
  return json;
}

Status RunReconstruct(const ReconstructArguments& arguments) {
  ASSIGN_OR_RETURN(auto outputs, OutputFiles::Create({arguments.left, arguments.right, arguments.calibration,
                                                      arguments.pattern},
                                                     {arguments.out, arguments.json}));
  ASSIGN_OR_RETURN(const auto pattern, LoadPatternSet(arguments.pattern));
  ASSIGN_OR_RETURN(const auto calibration, LoadStereoCalibration(arguments.calibration));
  ASSIGN_OR_RETURN(const auto left, ReadFrames(arguments.left, pattern));
  ASSIGN_OR_RETURN(const auto right, ReadFrames(arguments.right, pattern));
  ASSIGN_OR_RETURN(const auto result, Reconstruct(left, right, pattern, calibration, arguments.config));
  if (!arguments.json.empty()) {
    RETURN_IF_ERROR(WriteOutputFile(outputs.Staged(arguments.json), ToJson(result).dump(2) + "\n"));
  }
  RETURN_IF_ERROR(WritePly(outputs.Staged(arguments.out), result.cloud_in_camera));
  return outputs.Commit();
}

}  // namespace

void AddReconstructCommand(CLI::App& app, Status& outcome) {
  auto arguments = std::make_shared<ReconstructArguments>();
  CLI::App* command = app.add_subcommand("reconstruct", "Fringe images of one view to a point cloud");
  command->add_option("--left", arguments->left, "Directory with the left camera's frames")->required();
  command->add_option("--right", arguments->right, "Directory with the right camera's frames")->required();
  command->add_option("--calibration", arguments->calibration, "Stereo calibration (OpenCV file)")
      ->required();
  command->add_option("--pattern", arguments->pattern, "Pattern set (TOML)")->required();
  command->add_option("--out", arguments->out, "Point cloud to write (PLY)")->required();
  command->add_option("--json", arguments->json, "Quality figures to write (JSON)");
  command->add_option("--read-noise-dn", arguments->config.noise.read_noise_dn,
                      "Camera noise in the dark, 8-bit DN");
  command->add_option("--gain-dn", arguments->config.noise.gain_dn,
                      "Camera noise variance per grey value, 8-bit DN");
  command->add_option("--full-scale-16bit-dn", arguments->config.full_scale_16bit_dn,
                      "Largest value of 16-bit frames");
  command->add_option("--threads", arguments->config.threads, "0: all")->capture_default_str();
  command->callback([arguments, &outcome] {
    int& threads = arguments->config.threads;
    if (threads == 0) threads = std::max(1, static_cast<int>(std::thread::hardware_concurrency()));
    outcome = RunReconstruct(*arguments);
  });
}

}  // namespace forgescan
