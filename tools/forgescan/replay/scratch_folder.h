// A folder for the time of one command.
#pragma once

#include <cstdlib>
#include <filesystem>
#include <string>
#include <utility>

#include "services/common/result.h"

namespace forgescan {

class ScratchFolder {
 public:
  // In the system's folder for such things. Errors: kIo.
  static Result<ScratchFolder> Make() {
    std::error_code problem;
    std::string pattern = (std::filesystem::temp_directory_path(problem) / "forgescan-XXXXXX").string();
    if (problem || mkdtemp(pattern.data()) == nullptr) {
      return Fail(ErrorCode::kIo, "{} cannot be made", pattern);
    }
    return ScratchFolder(pattern);
  }
  ScratchFolder(ScratchFolder&& other) noexcept : path_(std::exchange(other.path_, {})) {}
  ScratchFolder& operator=(ScratchFolder&&) = delete;
  ~ScratchFolder() {
    std::error_code ignored;
    if (!path_.empty()) {
      std::filesystem::remove_all(path_, ignored);
    }
  }
  const std::filesystem::path& path() const { return path_; }

 private:
  explicit ScratchFolder(std::filesystem::path path) : path_(std::move(path)) {}
  std::filesystem::path path_;
};

}  // namespace forgescan
