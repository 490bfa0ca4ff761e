#include "services/robot/part_memory.h"

#include <filesystem>
#include <fstream>
#include <sstream>

#include "services/common/output_file.h"

namespace forgescan {

Status PartMemory::Recall() {
  std::error_code problem;
  if (path_.empty() || !std::filesystem::exists(path_, problem)) {
    return {};
  }
  AgedMap<std::int32_t, RememberedPart> read{16};
  std::ifstream stream(path_);
  for (std::string line; std::getline(stream, line);) {
    std::istringstream words(line);
    std::int32_t part = 0;
    RememberedPart remembered;
    std::string rest;
    const bool whole = static_cast<bool>(words >> part >> remembered.arrived_us >> remembered.views >>
                                         remembered.captured >> remembered.scanned >> remembered.sorted);
    if (!whole || part < 1 || (words >> rest)) {
      return Fail(ErrorCode::kFormat,
                  "{}: \"{}\" is no part: number from 1, arrival, views, captured, 0/1, 0/1", path_,
                  line.substr(0, 80));
    }
    read.Insert(part, remembered);
  }
  if (!stream.eof()) {
    return Fail(ErrorCode::kIo, "{}: cannot be read", path_);
  }
  parts_ = std::move(read);
  return {};
}

Status PartMemory::Write() {
  if (path_.empty()) {
    return {};
  }
  std::string text;
  parts_.ForEach([&text](std::int32_t part, const RememberedPart& remembered) {
    text += fmt::format("{} {} {} {} {} {}\n", part, remembered.arrived_us, remembered.views,
                        remembered.captured, remembered.scanned ? 1 : 0, remembered.sorted ? 1 : 0);
  });
  std::error_code ignored;  // the file then cannot be written, and that is told
  std::filesystem::create_directories(std::filesystem::path(path_).parent_path(), ignored);
  return WriteOutputFile(path_, text);
}

std::optional<std::pair<std::int32_t, RememberedPart>> PartMemory::Last() {
  std::optional<std::pair<std::int32_t, RememberedPart>> last;
  parts_.ForEach([&](std::int32_t part, const RememberedPart& remembered) { last = {part, remembered}; });
  return last;
}

Status PartMemory::Begin(std::int32_t part, const RememberedPart& remembered) {
  parts_.Insert(part, remembered);
  return Write();
}

Status PartMemory::Captured(std::int32_t part, std::int32_t captured) {
  if (RememberedPart* remembered = parts_.Find(part)) {
    remembered->captured = captured;
    return Write();
  }
  return {};
}

Status PartMemory::Scanned(std::int32_t part) {
  if (RememberedPart* remembered = parts_.Find(part)) {
    remembered->scanned = true;
    return Write();
  }
  return {};
}

Status PartMemory::Sorted(std::int32_t part) {
  if (RememberedPart* remembered = parts_.Find(part)) {
    remembered->sorted = true;
    return Write();
  }
  return {};
}

}  // namespace forgescan
