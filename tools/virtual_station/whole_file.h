// Files that are there completely or not at all.
#pragma once

#include <string>

#include "services/common/result.h"

namespace forgescan {

// Writes under another name, then renames. Errors: kIo naming the path.
Status WriteWholeFile(const std::string& path, const std::string& text);

}  // namespace forgescan
