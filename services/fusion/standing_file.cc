#include "services/fusion/standing_file.h"

#include <libdeflate.h>

#include <charconv>
#include <cmath>
#include <filesystem>

#include "services/common/geometry/cloud_io.h"
#include "services/common/geometry/ply_format.h"
#include "services/common/input_file.h"

namespace forgescan {
namespace {

constexpr std::uintmax_t kMaxFileBytes = 60'000'000;  // a recording takes no larger one
constexpr double kMinCellRad = 1e-4, kMaxCellRad = 0.1;
constexpr double kMaxSigmaMm = 1;
constexpr float kUnitWithin = 1e-3F;  // of the length of a normal

// The number after `word` in the only comment that begins with it.
template <typename Number>
Result<Number> CommentNumber(const PlyHeader& header, const std::string& word, const std::string& name) {
  std::string text;
  int found = 0;
  for (const std::string& comment : header.comments) {
    if (comment.starts_with(word + " ")) {
      text = comment.substr(word.size() + 1);
      ++found;
    }
  }
  Number number{};
  const char* const end = text.data() + text.size();
  const auto [stop, failure] = std::from_chars(text.data(), end, number);
  if (found != 1 || failure != std::errc() || stop != end) {
    return Fail(ErrorCode::kFormat,
                "{}: needs one line \"comment {} NUMBER\" in its header: not a file of standing surfaces",
                name, word);
  }
  return number;
}

Result<StandingSurfaces> ReadComments(std::string_view bytes, const std::string& name) {
  ASSIGN_OR_RETURN(const PlyHeader header, ParsePlyHeader(bytes, name));
  StandingSurfaces standing;
  ASSIGN_OR_RETURN(standing.origin.path_crc32, CommentNumber<std::uint32_t>(header, "path_crc32", name));
  ASSIGN_OR_RETURN(standing.origin.calibration_crc32,
                   CommentNumber<std::uint32_t>(header, "calibration_crc32", name));
  ASSIGN_OR_RETURN(standing.cell_rad, CommentNumber<double>(header, "cell_rad", name));
  ASSIGN_OR_RETURN(standing.scans, CommentNumber<int>(header, "scans", name));
  if (!(standing.cell_rad >= kMinCellRad && standing.cell_rad <= kMaxCellRad)) {
    return Fail(ErrorCode::kFormat, "{}: cell_rad is {}, allowed {} to {}", name, standing.cell_rad,
                kMinCellRad, kMaxCellRad);
  }
  if (standing.scans < 1) {
    return Fail(ErrorCode::kFormat, "{}: scans is {}, allowed 1 and up", name, standing.scans);
  }
  return standing;
}

Status CheckColumns(const CloudFromFile& cloud, const std::string& name) {
  if (cloud.not_finite > 0) {
    return Fail(ErrorCode::kFormat, "{}: {} of its cells have a coordinate that is no number", name,
                cloud.not_finite);
  }
  const std::size_t n = cloud.size();
  if (n == 0 || cloud.normals.size() != n || cloud.sigma_mm.size() != n || cloud.view.size() != n) {
    return Fail(ErrorCode::kFormat, "{}: needs cells with x y z nx ny nz sigma_mm view; it has {} points",
                name, n);
  }
  return {};
}

// What is wrong with a cell, one clause; empty = nothing.
std::string ProblemOf(const CloudFromFile& cloud, std::size_t i, std::size_t views) {
  const double sigma_mm = cloud.sigma_mm[i];
  if (cloud.view[i] >= views) {
    return fmt::format("is of view {}, the path has views 0 to {}", cloud.view[i], views - 1);
  }
  if (!(sigma_mm > 0 && sigma_mm <= kMaxSigmaMm)) {
    return fmt::format("has a sigma_mm of {}, allowed is above 0 to {}", sigma_mm, kMaxSigmaMm);
  }
  if (!(std::abs(cloud.normals[i].norm() - 1) <= kUnitWithin)) {
    return "has a normal whose length is not 1";
  }
  return {};
}

Status AddCells(const CloudFromFile& cloud, std::size_t views, const std::string& name,
                StandingSurfaces& standing) {
  standing.views.resize(views);
  for (std::size_t i = 0; i < cloud.size(); ++i) {
    std::string problem = ProblemOf(cloud, i, views);
    const Eigen::Vector3d point = cloud.points[i].cast<double>();
    const auto key = DirectionKey(point, standing.cell_rad);
    const bool new_view = i == 0 || cloud.view[i] > cloud.view[i - 1];
    if (problem.empty() && !key) problem = "is not in front of the camera";
    if (problem.empty() && !new_view) {
      const auto& before = standing.views[cloud.view[i - 1]].back();
      if (cloud.view[i] < cloud.view[i - 1] || *key <= before.key) {
        problem = "is not after the one before it by view and direction";
      }
    }
    if (!problem.empty()) {
      return Fail(ErrorCode::kFormat, "{}: cell {} {}", name, i, problem);
    }
    const double sigma_mm = cloud.sigma_mm[i];
    standing.views[cloud.view[i]].push_back(
        {*key, point, cloud.normals[i].cast<double>().normalized(), sigma_mm * sigma_mm});
  }
  return {};
}

Status CheckOrigin(const StandingOrigin& of_file, const StandingOrigin& expected, const std::string& name) {
  if (of_file.path_crc32 != expected.path_crc32) {
    return Fail(
        ErrorCode::kInvalidArgument,
        "{}: its surfaces were seen on the robot's path {:08x}, the view matrices were taught on {:08x}: "
        "make it again (forgescan standing)",
        name, of_file.path_crc32, expected.path_crc32);
  }
  if (of_file.calibration_crc32 != expected.calibration_crc32) {
    return Fail(
        ErrorCode::kInvalidArgument,
        "{}: its surfaces were seen with the calibration {:08x}, the station has {:08x}: make it again "
        "(forgescan standing)",
        name, of_file.calibration_crc32, expected.calibration_crc32);
  }
  return {};
}

}  // namespace

Status WriteStandingSurfaces(const std::string& path, const StandingSurfaces& standing) {
  PointCloud cloud;
  for (std::size_t view = 0; view < standing.views.size(); ++view) {
    for (const SurfaceCell& cell : standing.views[view]) {
      const Eigen::Vector3f point = cell.point.cast<float>();
      if (DirectionKey(point.cast<double>(), standing.cell_rad) != cell.key) continue;
      cloud.points.push_back(point);
      cloud.normals.push_back(cell.normal.cast<float>());
      cloud.sigma_mm.push_back(static_cast<float>(std::sqrt(cell.variance_mm2)));
      cloud.view.push_back(static_cast<std::uint16_t>(view));
    }
  }
  return WritePly(path, cloud,
                  {"standing surfaces of forgescan, cells in the camera frame of their view",
                   fmt::format("path_crc32 {}", standing.origin.path_crc32),
                   fmt::format("calibration_crc32 {}", standing.origin.calibration_crc32),
                   fmt::format("cell_rad {}", standing.cell_rad), fmt::format("scans {}", standing.scans)});
}

Result<StandingSurfaces> LoadStandingSurfaces(const std::string& path, const StandingOrigin& expected,
                                              std::size_t views) {
  std::error_code problem;
  const std::uintmax_t size = std::filesystem::file_size(path, problem);
  if (!problem && size > kMaxFileBytes) {
    return Fail(ErrorCode::kFormat, "{}: has {} bytes, allowed are {}", path, size, kMaxFileBytes);
  }
  ASSIGN_OR_RETURN(const std::string bytes, ReadInputFile(path));
  ASSIGN_OR_RETURN(StandingSurfaces standing, ReadComments(bytes, path));
  RETURN_IF_ERROR(CheckOrigin(standing.origin, expected, path));
  ASSIGN_OR_RETURN(const CloudFromFile cloud, ParsePointCloud(bytes, path));
  RETURN_IF_ERROR(CheckColumns(cloud, path));
  RETURN_IF_ERROR(AddCells(cloud, views, path, standing));
  return standing;
}

Result<std::uint32_t> Crc32OfFile(const std::string& path) {
  ASSIGN_OR_RETURN(const std::string bytes, ReadInputFile(path));
  return libdeflate_crc32(0, bytes.data(), bytes.size());
}

}  // namespace forgescan
