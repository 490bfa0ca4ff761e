#include "services/common/log/log_reader.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <utility>

#include "services/common/log/file_window.h"
#include "services/common/log/log_header.h"
#include "services/common/log/log_scanner.h"

namespace forgescan {

Result<LogReader> LogReader::Open(const std::string& path) {
  const int fd = open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK);  // nor wait for a pipe's other end
  if (fd < 0) {
    return Fail(errno == ENOENT ? ErrorCode::kNotFound : ErrorCode::kIo, "{}: {}", path,
                std::strerror(errno));
  }
  struct stat status {};
  const bool is_file = fstat(fd, &status) == 0 && S_ISREG(status.st_mode);
  LogReader reader(path, fd, is_file ? static_cast<std::uint64_t>(status.st_size) : 0);
  if (!is_file) {
    return Fail(ErrorCode::kIo, "{}: is not a file", path);
  }
  Result<LogIndex> index = LogScanner(fd, reader.file_bytes_).Run();
  if (!index.ok()) {
    return Fail(index.error().code, "{}: {}", path, index.error().message);
  }
  if (index->entries.empty()) {
    return Fail(ErrorCode::kFormat, "{}: {} bytes hold not one event of an LCM log", path,
                reader.file_bytes_);
  }
  reader.entries_ = std::move(index->entries);
  reader.damage_ = std::move(index->damage);
  reader.channels_ = std::move(index->channels);
  return reader;
}

LogReader::LogReader(std::string path, int fd, std::uint64_t file_bytes)
    : path_(std::move(path)), fd_(fd), file_bytes_(file_bytes) {}

LogReader::LogReader(LogReader&& other) noexcept : LogReader({}, -1, 0) { *this = std::move(other); }

LogReader& LogReader::operator=(LogReader&& other) noexcept {
  std::swap(path_, other.path_);
  std::swap(fd_, other.fd_);
  std::swap(file_bytes_, other.file_bytes_);
  std::swap(entries_, other.entries_);
  std::swap(damage_, other.damage_);
  std::swap(channels_, other.channels_);
  return *this;
}

LogReader::~LogReader() {
  if (fd_ >= 0) {
    close(fd_);
  }
}

Result<Bytes> LogReader::Read(const LogEntry& entry, std::size_t at_most) const {
  std::array<std::uint8_t, kMaxLogHeadBytes> head{};
  const std::span<std::uint8_t> head_bytes = std::span(head).first(kLogHeaderBytes + ChannelOf(entry).size());
  Bytes message(std::min<std::size_t>(entry.bytes, at_most));
  Status status = ReadFileAt(fd_, entry.offset, head_bytes);
  if (status.ok()) {
    status = ReadFileAt(fd_, entry.offset + head_bytes.size(), message);
  }
  if (!status.ok()) {
    return Fail(status.error().code, "{}: {}", path_, status.error().message);
  }
  const auto header = ParseLogHeader(head_bytes, entry.offset, LogNames::kUtf8);
  if (!HasLogSyncWord(head_bytes) || !header || header->number != entry.number ||
      header->bytes != entry.bytes) {
    return Fail(ErrorCode::kIo, "{}: the event at byte {} has changed since the file was opened", path_,
                entry.offset);
  }
  return message;
}

}  // namespace forgescan
