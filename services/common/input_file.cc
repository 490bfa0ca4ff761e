#include "services/common/input_file.h"

#include <fstream>
#include <system_error>

namespace forgescan {

constexpr std::uintmax_t kMaxFileBytes = std::uintmax_t{4} << 30;

Result<std::string> ReadInputFile(const std::filesystem::path& path) {
  std::error_code problem;
  const auto type = std::filesystem::status(path, problem).type();
  if (type == std::filesystem::file_type::not_found || type == std::filesystem::file_type::none) {
    return Fail(ErrorCode::kNotFound, "{}: cannot be read: {}", path.string(), problem.message());
  }
  if (type != std::filesystem::file_type::regular) {
    return Fail(ErrorCode::kIo, "{}: cannot be read: not a plain file", path.string());
  }
  const std::uintmax_t size = std::filesystem::file_size(path, problem);
  if (problem) return Fail(ErrorCode::kIo, "{}: cannot be read: {}", path.string(), problem.message());
  if (size > kMaxFileBytes) {
    return Fail(ErrorCode::kFormat, "{}: {} bytes, at most 4 GiB are read", path.string(), size);
  }
  std::string text(size, '\0');
  std::ifstream stream(path, std::ios::binary);
  if (!stream.read(text.data(), static_cast<std::streamsize>(size))) {
    return Fail(ErrorCode::kIo, "{}: its {} bytes cannot be read", path.string(), size);
  }
  return text;
}

}  // namespace forgescan
