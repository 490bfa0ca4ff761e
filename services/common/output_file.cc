#include "services/common/output_file.h"

#include <fstream>
#include <system_error>

namespace forgescan {
namespace {

namespace fs = std::filesystem;

Status WriteTo(const fs::path& path, const fs::path& named, std::string_view bytes) {
  std::ofstream file(path, std::ios::binary | std::ios::trunc);
  file.write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
  file.close();  // flushes; a failure of either stays in the state
  if (!file) {
    return Fail(ErrorCode::kIo, "{}: cannot write {} bytes there", named.string(), bytes.size());
  }
  return {};
}

}  // namespace

bool IsDevice(const fs::path& path) {
  std::error_code error;
  return fs::exists(path, error) && !fs::is_regular_file(path, error) && !fs::is_directory(path, error);
}

Status WriteOutputFile(const fs::path& path, std::string_view bytes) {
  if (IsDevice(path)) {
    return WriteTo(path, path, bytes);
  }
  fs::path part = path;
  part += ".part";
  Status status = WriteTo(part, path, bytes);
  std::error_code failure, ignored;
  if (status.ok()) {
    fs::rename(part, path, failure);
  }
  if (failure) {
    status = Fail(ErrorCode::kIo, "{}: cannot be put in place ({})", path.string(), failure.message());
  }
  if (!status.ok()) {
    fs::remove(part, ignored);
  }
  return status;
}

}  // namespace forgescan
