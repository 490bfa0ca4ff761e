#include "services/report/report_files.h"

#include <cerrno>
#include <cstring>
#include <filesystem>
#include <fstream>

namespace forgescan {

Status WriteWholeFile(const std::string& path, std::string_view content) {
  const std::filesystem::path target(path);
  std::error_code failure;
  std::filesystem::create_directories(target.parent_path(), failure);
  if (failure) {
    return Fail(ErrorCode::kIo, "cannot make the folder of {}: {}", path, failure.message());
  }
  const std::string temporary = path + ".part";
  errno = 0;
  std::ofstream file(temporary, std::ios::binary | std::ios::trunc);
  file.write(content.data(), static_cast<std::streamsize>(content.size()));
  file.close();
  if (!file) {
    const int reason = errno;
    std::filesystem::remove(temporary, failure);
    return Fail(ErrorCode::kIo, "cannot write {}: {}", temporary, std::strerror(reason));
  }
  std::filesystem::rename(temporary, target, failure);
  if (failure) {
    return Fail(ErrorCode::kIo, "cannot rename {} to {}: {}", temporary, path, failure.message());
  }
  return {};
}

}  // namespace forgescan
