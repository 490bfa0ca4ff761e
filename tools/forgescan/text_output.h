// A pose as text.
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

}  // namespace forgescan
