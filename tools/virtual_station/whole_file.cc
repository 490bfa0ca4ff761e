#include "tools/virtual_station/whole_file.h"

#include <cstdio>
#include <fstream>

namespace forgescan {

Status WriteWholeFile(const std::string& path, const std::string& text) {
  const std::string temporary = path + ".part";
  std::ofstream file(temporary, std::ios::binary);
  file << text;
  file.close();
  if (!file || std::rename(temporary.c_str(), path.c_str()) != 0) {
    std::remove(temporary.c_str());
    return Fail(ErrorCode::kIo, "{}: could not be written", path);
  }
  return {};
}

}  // namespace forgescan
