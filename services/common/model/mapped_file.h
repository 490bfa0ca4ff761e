// A file in memory without reading it.
#pragma once

#include <filesystem>
#include <memory>
#include <string_view>

#include "services/common/result.h"

namespace forgescan {

// Read-only; unmapped with the last owner. The file may be replaced by another meanwhile (mv, or a program of
// ours, which all replace files whole); overwritten in place, it ends the process with SIGBUS or changes what
// was checked.
class MappedFile {
 public:
  // Errors: kNotFound for no file of that name, or one that cannot be read; kIo if it is not a plain file or
  // cannot be mapped; kFormat if it is empty.
  static Result<std::shared_ptr<const MappedFile>> Open(const std::filesystem::path& path);
  ~MappedFile();
  MappedFile(const MappedFile&) = delete;
  MappedFile& operator=(const MappedFile&) = delete;

  // From a page's beginning.
  std::string_view bytes() const { return bytes_; }

 private:
  explicit MappedFile(std::string_view bytes) : bytes_(bytes) {}

  std::string_view bytes_;
};

}  // namespace forgescan
