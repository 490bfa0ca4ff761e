// The file of a station's standing surfaces: a binary PLY of the cells of all views (point, normal, sigma_mm,
// view; camera frame of the view), whose comments say what they were seen with.
#pragma once

#include <string>

#include "services/fusion/standing_surfaces.h"

namespace forgescan {

// A cell whose point, rounded to float, falls into the neighbour's direction is left out. Errors: kIo.
Status WriteStandingSurfaces(const std::string& path, const StandingSurfaces& standing);

// `views` of the path. Errors: kNotFound; kFormat (no such PLY, cells out of order or of a view that does not
// exist, a number that cannot be); kInvalidArgument (made on another path or with another calibration). Each
// names the file.
Result<StandingSurfaces> LoadStandingSurfaces(const std::string& path, const StandingOrigin& expected,
                                              std::size_t views);

// CRC-32 of a file's bytes, for StandingOrigin. Errors: kNotFound.
Result<std::uint32_t> Crc32OfFile(const std::string& path);

}  // namespace forgescan
