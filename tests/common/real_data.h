// Where the real data are that some tests use: public research data, not part of the repository.
#pragma once

#include <cstdlib>
#include <filesystem>
#include <optional>
#include <string>

namespace forgescan {

// The folder `name` of FORGESCAN_DATA_DIR, or else of ../shared/data beside the source tree; nothing if it is
// not there. A test then skips itself with kNoRealData.
inline std::optional<std::filesystem::path> RealData(const std::string& name) {
  const char* from_environment = std::getenv("FORGESCAN_DATA_DIR");
  const std::filesystem::path root = from_environment != nullptr
                                         ? std::filesystem::path(from_environment)
                                         : std::filesystem::path(FORGESCAN_SOURCE_DIR) / "../shared/data";
  std::error_code error;
  const bool exists = std::filesystem::exists(root / name, error);
  return exists ? std::optional(root / name) : std::nullopt;
}

inline constexpr const char* kNoRealData = " is not here: set FORGESCAN_DATA_DIR to the folder that holds it";

}  // namespace forgescan
