#include "services/common/input_file.h"

#include <fstream>
#include <iterator>

namespace forgescan {

Result<std::string> ReadInputFile(const std::filesystem::path& path) {
  std::ifstream stream(path, std::ios::binary);
  std::string text{std::istreambuf_iterator<char>(stream), {}};
  if (!stream.is_open() || stream.bad()) {
    return Fail(ErrorCode::kNotFound, "{}: cannot be read", path.string());
  }
  return text;
}

}  // namespace forgescan
