// What several commands print or write: a pose as text, a whole file under its name or not at all.
#pragma once

#include <Eigen/Geometry>
#include <filesystem>
#include <string>

#include "services/common/result.h"

namespace forgescan {

// Four lines of four numbers, row-major, mm.
std::string PoseText(const Eigen::Isometry3d& pose);

// Sixteen numbers, row-major, separated by white space or commas. Errors: kNotFound, kFormat (count, last
// row, not rigid).
Result<Eigen::Isometry3d> ReadPose(const std::filesystem::path& path);

// Under another name first, then renamed. Errors: kIo.
Status WriteText(const std::filesystem::path& path, const std::string& text);

}  // namespace forgescan
