// Reads a file through a window of fixed size: no mapping that a truncated file would turn into a crash, and
// memory that does not depend on the file.
#pragma once

#include <cstdint>

#include "services/common/bus/bus.h"
#include "services/common/result.h"

namespace forgescan {

// Fills `to` from `offset` on. Errors: kIo (with the system's reason, or that the file ends earlier).
Status ReadFileAt(int fd, std::uint64_t offset, std::span<std::uint8_t> to);

class FileWindow {
 public:
  // fd: open for reading, outlives this. window_bytes: what one read takes.
  FileWindow(int fd, std::uint64_t file_bytes, std::size_t window_bytes);

  // Bytes of the file from `offset` on: at least `count` of them, fewer only at the end of the file, more if
  // they are at hand. Empty after an error, for good. Holds until the next call.
  ByteView From(std::uint64_t offset, std::size_t count);
  const Status& status() const { return status_; }

 private:
  int fd_;
  std::uint64_t file_bytes_;
  std::size_t window_bytes_;
  std::uint64_t begin_ = 0;  // of the window, in the file
  Bytes window_;
  Status status_;
};

}  // namespace forgescan
