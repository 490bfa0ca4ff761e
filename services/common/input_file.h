// A file that a user named, as text.
#pragma once

#include <filesystem>
#include <string>

#include "services/common/result.h"

namespace forgescan {

// All bytes of the file. Errors: kNotFound (it cannot be read).
Result<std::string> ReadInputFile(const std::filesystem::path& path);

}  // namespace forgescan
