// The file of a ball bar's placements: certificate, measuring volume, prior of the calibration, and what was
// measured.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string_view>
#include <vector>

#include "services/common/calibration/refine_calibration.h"

namespace forgescan {

// A placement measures its centres, or names the cloud they are fitted in and where the balls were put.
struct PlacementEntry {
  std::string name;
  std::array<Eigen::Vector3d, 2> center_mm;  // or where the balls lie within 0.4 of their radius
  std::filesystem::path cloud;               // empty: the centres are measured
};

struct PlacementsFile {
  BallBar bar;
  RefinementOptions options;
  // Of the bytes of the calibration's file that made the points. Never empty if there are clouds.
  std::optional<std::uint32_t> calibration_crc32;
  double center_sigma_mm = 0.003;  // of a coordinate of a centre, if a reproducibility study gives no better
  std::vector<PlacementEntry> placements;
};

// Shape and units: docs/calibration.md. Paths of clouds are taken from `folder`. Errors: those of ConfigFile,
// each with name and key; clouds need calibration_crc32.
Result<PlacementsFile> ParsePlacements(std::string_view text, const std::string& name,
                                       const std::filesystem::path& folder);

// The centres of every placement, those of clouds by FitBall. Frames: rectified left camera. Errors: those of
// ReadPointCloud and FitBall, with the placement's name.
Result<std::vector<BarPlacement>> MeasurePlacements(const PlacementsFile& file);

}  // namespace forgescan
