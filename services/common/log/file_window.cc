#include "services/common/log/file_window.h"

#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>

namespace forgescan {

Status ReadFileAt(int fd, std::uint64_t offset, std::span<std::uint8_t> to) {
  while (!to.empty()) {
    const ssize_t got = pread(fd, to.data(), to.size(), static_cast<off_t>(offset));
    if (got < 0 && errno == EINTR) {
      continue;
    }
    if (got <= 0) {
      return Fail(ErrorCode::kIo, "byte {} cannot be read: {}", offset,
                  got < 0 ? std::strerror(errno) : "the file ends there, it has become shorter");
    }
    to = to.subspan(static_cast<std::size_t>(got));
    offset += static_cast<std::uint64_t>(got);
  }
  return {};
}

FileWindow::FileWindow(int fd, std::uint64_t file_bytes, std::size_t window_bytes)
    : fd_(fd), file_bytes_(file_bytes), window_bytes_(window_bytes) {}

ByteView FileWindow::From(std::uint64_t offset, std::size_t count) {
  if (!status_.ok() || offset >= file_bytes_) {
    return {};
  }
  const std::uint64_t wanted = std::min<std::uint64_t>(count, file_bytes_ - offset);
  if (offset < begin_ || offset + wanted > begin_ + window_.size()) {
    const std::uint64_t bytes = std::min<std::uint64_t>(std::max(count, window_bytes_), file_bytes_ - offset);
    window_.resize(static_cast<std::size_t>(bytes));
    begin_ = offset;
    status_ = ReadFileAt(fd_, offset, window_);
    if (!status_.ok()) {
      return {};
    }
  }
  return ByteView(window_).subspan(static_cast<std::size_t>(offset - begin_));
}

}  // namespace forgescan
