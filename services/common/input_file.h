// A file that a user named, as it is.
#pragma once

#include <filesystem>
#include <string>

#include "services/common/result.h"

namespace forgescan {

// All bytes of a plain file; a pipe would make a service wait. Errors: kNotFound; kIo (a folder, a device, a
// pipe, or it cannot be read); kFormat if longer than 4 GiB.
Result<std::string> ReadInputFile(const std::filesystem::path& path);

}  // namespace forgescan
