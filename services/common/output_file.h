// What a program writes for a user: a file that is whole or not there, or a device or pipe.
#pragma once

#include <filesystem>
#include <string_view>

#include "services/common/result.h"

namespace forgescan {

// True for what exists and is neither a file nor a folder (links are followed): a device, a pipe, a socket.
bool IsDevice(const std::filesystem::path& path);

// A file is written beside its place as `path`.part and renamed, so that nobody ever reads half of it. A
// device or a pipe keeps its place and is written directly. Errors: kIo; nothing is left of a file, a pipe's
// reader may have had a part.
Status WriteOutputFile(const std::filesystem::path& path, std::string_view bytes);

}  // namespace forgescan
