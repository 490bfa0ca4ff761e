// Files and folders that appear under their names when they are whole, and never replace anything.
#pragma once

#include <filesystem>
#include <string>

#include "services/common/result.h"

namespace forgescan {

// What a command appends to the name of an output until it is whole, of this process alone: what an
// interrupted one has left does not stand in the way of the next.
std::string StagedEnding();

// Renames a file or folder. Errors: kIo (with the system's reason; also when `to` exists).
Status RenameToNew(const std::filesystem::path& from, const std::filesystem::path& to);

}  // namespace forgescan
