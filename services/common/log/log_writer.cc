#include "services/common/log/log_writer.h"

#include <fcntl.h>
#include <lcm/eventlog.h>
#include <stdio_ext.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <utility>

#include "services/common/log/log_format.h"
#include "services/common/new_file.h"

namespace forgescan {
namespace {

// The name of a new file is on the disk only when its folder is.
Status SyncFolderOf(const std::string& path) {
  const std::filesystem::path parent = std::filesystem::path(path).parent_path();
  const std::string folder = parent.empty() ? "." : parent.string();
  const int fd = open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  const bool synced = fd >= 0 && fsync(fd) == 0;
  const int reason = errno;
  if (fd >= 0) {
    close(fd);
  }
  if (!synced) {
    return Fail(ErrorCode::kIo, "{}: its folder cannot be brought to the disk ({})", path,
                std::strerror(reason));
  }
  return {};
}

}  // namespace

LogWriter::LogWriter(std::string path, std::string open_path, _lcm_eventlog_t* log)
    : path_(std::move(path)), open_path_(std::move(open_path)), log_(log) {}

LogWriter::LogWriter(LogWriter&& other) noexcept
    : path_(std::move(other.path_)),
      open_path_(std::move(other.open_path_)),
      log_(std::exchange(other.log_, nullptr)),
      events_(other.events_),
      file_bytes_(other.file_bytes_) {}

LogWriter& LogWriter::operator=(LogWriter&& other) noexcept {
  if (this != &other) {
    if (log_ != nullptr) {
      lcm_eventlog_destroy(log_);
    }
    path_ = std::move(other.path_);
    open_path_ = std::move(other.open_path_);
    log_ = std::exchange(other.log_, nullptr);
    events_ = other.events_;
    file_bytes_ = other.file_bytes_;
  }
  return *this;
}

LogWriter::~LogWriter() {
  if (log_ != nullptr) {
    lcm_eventlog_destroy(log_);
  }
}

Result<LogWriter> LogWriter::Create(const std::string& path, const std::string& ending) {
  const std::string part = path + ending;
  if (access(path.c_str(), F_OK) == 0) {
    return Fail(ErrorCode::kIo, "{} exists already; a recording is never overwritten", path);
  }
  const int fd = open(part.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0644);
  if (fd < 0) {
    return Fail(ErrorCode::kIo, "{} cannot be made ({})", part, std::strerror(errno));
  }
  close(fd);
  lcm_eventlog_t* log = lcm_eventlog_create(part.c_str(), "w");
  if (log == nullptr) {
    const int reason = errno;
    unlink(part.c_str());
    return Fail(ErrorCode::kIo, "{} cannot be opened for writing ({})", part, std::strerror(reason));
  }
  LogWriter writer(path, part, log);
  RETURN_IF_ERROR(SyncFolderOf(part));
  return writer;
}

// What is in stdio's buffer must never reach the file after a failure: it is dropped before the file is
// closed.
Status LogWriter::Broken(const char* what) {
  const int reason = errno;
  __fpurge(log_->f);
  const bool whole = ftruncate(fileno(log_->f), file_bytes_) == 0;
  lcm_eventlog_destroy(log_);
  log_ = nullptr;
  return Fail(ErrorCode::kIo, "{}: {} failed after {} events and {} bytes ({}){}", open_path_, what, events_,
              file_bytes_, std::strerror(reason), whole ? "" : "; the file may end with half an event");
}

Status LogWriter::Write(std::string_view channel, std::int64_t utime, ByteView message) {
  if (channel.empty() || channel.size() > kMaxLogChannelBytes || message.size() > kMaxLogMessageBytes) {
    return Fail(ErrorCode::kInvalidArgument,
                "{}: an event on \"{}\" with {} bytes is outside 1 to {} characters and 0 to {} bytes", path_,
                channel.substr(0, kMaxLogChannelBytes), message.size(), kMaxLogChannelBytes,
                kMaxLogMessageBytes);
  }
  if (log_ == nullptr) {
    return Fail(ErrorCode::kIo, "{}: is closed; nothing can be written any more", path_);
  }
  lcm_eventlog_event_t event{};
  event.timestamp = utime;
  event.channellen = static_cast<std::int32_t>(channel.size());
  event.datalen = static_cast<std::int32_t>(message.size());
  event.channel = const_cast<char*>(channel.data());       // only read
  event.data = const_cast<std::uint8_t*>(message.data());  // only read
  if (lcm_eventlog_write_event(log_, &event) != 0 || std::fflush(log_->f) != 0) {
    return Broken("writing");
  }
  ++events_;
  file_bytes_ += static_cast<std::int64_t>(kLogHeaderBytes + channel.size() + message.size());
  return {};
}

Status LogWriter::Sync() {
  if (log_ == nullptr) {
    return Fail(ErrorCode::kIo, "{}: is closed; nothing can be brought to the disk any more", path_);
  }
  return fdatasync(fileno(log_->f)) == 0 ? Status() : Broken("bringing it to the disk");
}

Status LogWriter::CloseAs(const std::string& path) {
  RETURN_IF_ERROR(Sync());
  lcm_eventlog_destroy(std::exchange(log_, nullptr));
  RETURN_IF_ERROR(RenameToNew(open_path_, path));
  path_ = path;
  return SyncFolderOf(path_);
}

}  // namespace forgescan
