#include "services/common/calibration/placements_file.h"

#include <algorithm>

#include "services/common/config/config.h"
#include "services/common/features/ball_fit.h"
#include "services/common/geometry/cloud_io.h"

namespace forgescan {
namespace {

constexpr double kMaxMm = 10'000;

void ReadBar(ConfigTable& root, BallBar& bar) {
  double expanded_mm = 0, coverage = 2;
  root.Required("distance_mm", bar.distance_mm, 1.0, kMaxMm);
  root.Required("expanded_uncertainty_mm", expanded_mm, 0.0, 1.0);
  root.Optional("coverage_factor", coverage, 1.0, 5.0);
  root.Required("ball_radius_mm", bar.ball_radius_mm, 0.1, 1000.0);
  bar.distance_sigma_mm = expanded_mm / coverage;
}

Eigen::Vector3d ReadVector(ConfigTable& table, std::string_view key) {
  std::vector<double> numbers(3, 0.0);
  table.Required(key, numbers, 3, -kMaxMm, kMaxMm);
  return numbers.size() == 3 ? Eigen::Vector3d(numbers[0], numbers[1], numbers[2]) : Eigen::Vector3d::Zero();
}

void ReadPrior(ConfigTable table, CalibrationPrior& prior) {
  table.Optional("focal_px", prior.focal_px, 0.0, 100.0);
  table.Optional("center_px", prior.center_px, 0.0, 100.0);
  table.Optional("k1", prior.k1, 0.0, 0.1);
  table.Optional("rotation_rad", prior.rotation_rad, 0.0, 0.01);
  table.Optional("translation_mm", prior.translation_mm, 0.0, 10.0);
}

PlacementEntry ReadPlacement(ConfigTable& table, const std::filesystem::path& folder) {
  PlacementEntry placement;
  table.Required("name", placement.name);
  std::string cloud;
  table.Optional("cloud", cloud);
  const bool has_cloud = !cloud.empty();
  if (has_cloud) placement.cloud = folder / cloud;
  placement.center_mm = {ReadVector(table, has_cloud ? "near_1_mm" : "center_1_mm"),
                         ReadVector(table, has_cloud ? "near_2_mm" : "center_2_mm")};
  return placement;
}

Result<BarPlacement> Measure(const PlacementEntry& entry, const PlacementsFile& file) {
  BarPlacement placement{entry.name, entry.center_mm, file.center_sigma_mm};
  if (entry.cloud.empty()) return placement;
  ASSIGN_OR_RETURN(const CloudFromFile cloud, ReadPointCloud(entry.cloud));
  for (std::size_t i = 0; i < 2; ++i) {
    const auto ball = FitBall(cloud, {entry.center_mm[i], Eigen::Vector3d::Zero(), file.bar.ball_radius_mm});
    if (!ball.ok()) {
      return Fail(ball.error().code, "{}: placement {}, ball {}: {}", entry.cloud.string(), entry.name, i + 1,
                  ball.error().message);
    }
    placement.center_in_camera[i] = ball->center;
  }
  return placement;
}

void ReadCalibrationCrc(ConfigTable& root, PlacementsFile& file) {
  const bool has_clouds = std::any_of(file.placements.begin(), file.placements.end(),
                                      [](const PlacementEntry& entry) { return !entry.cloud.empty(); });
  if (!has_clouds && !root.Has("calibration_crc32")) return;
  std::int64_t crc = 0;
  root.Required("calibration_crc32", crc, std::int64_t{0}, std::int64_t{0xffffffff});
  file.calibration_crc32 = static_cast<std::uint32_t>(crc);
}

}  // namespace

Result<PlacementsFile> ParsePlacements(std::string_view text, const std::string& name,
                                       const std::filesystem::path& folder) {
  ASSIGN_OR_RETURN(const ConfigFile config, ConfigFile::Parse(text, name));
  ConfigTable root = config.Root();
  PlacementsFile file;
  ReadBar(root, file.bar);
  file.options.placements.volume_mm = ReadVector(root, "volume_mm");
  root.Optional("center_sigma_mm", file.center_sigma_mm, 1e-6, 1.0);
  ReadPrior(root.Table("prior"), file.options.prior);
  for (ConfigTable& table : root.Tables("placement")) file.placements.push_back(ReadPlacement(table, folder));
  ReadCalibrationCrc(root, file);
  RETURN_IF_ERROR(root.Finish());
  return file;
}

Result<std::vector<BarPlacement>> MeasurePlacements(const PlacementsFile& file) {
  std::vector<BarPlacement> placements;
  for (const PlacementEntry& entry : file.placements) {
    ASSIGN_OR_RETURN(BarPlacement placement, Measure(entry, file));
    placements.push_back(std::move(placement));
  }
  return placements;
}

}  // namespace forgescan
