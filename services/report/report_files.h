// Files that are whole or not there.
#pragma once

#include <string>
#include <string_view>

#include "services/common/result.h"

namespace forgescan {

// Writes to a temporary name in the same folder, which is made if missing, and renames: a reader never sees
// half a file. Errors: kIo, with the path and the system's reason.
Status WriteWholeFile(const std::string& path, std::string_view content);

}  // namespace forgescan
