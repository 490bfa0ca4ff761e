#include "services/common/locked_file.h"

#include <fcntl.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>

namespace forgescan {
namespace {

struct flock WholeFile() {
  struct flock whole {};  // from 0, of every length; a lock of the open file, not of the process
  whole.l_type = F_WRLCK;
  whole.l_whence = SEEK_SET;
  return whole;
}

}  // namespace

OwnedFd::~OwnedFd() {
  if (fd_ >= 0) {
    close(fd_);
  }
}

Result<OwnedFd> LockFile(const std::string& path) {
  OwnedFd file(open(path.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0644));
  if (file.get() < 0) {
    return Fail(ErrorCode::kIo, "{} cannot be written: {}", path, std::strerror(errno));
  }
  struct flock wanted = WholeFile();
  if (fcntl(file.get(), F_OFD_SETLK, &wanted) != 0) {
    const bool held = errno == EAGAIN || errno == EACCES;
    return held ? Fail(ErrorCode::kUnavailable, "{} is held by another process", path)
                : Fail(ErrorCode::kIo, "{} cannot be locked: {}", path, std::strerror(errno));
  }
  return file;
}

bool IsLockedByAnother(const OwnedFd& file) {
  struct flock held = WholeFile();
  return file.get() >= 0 && fcntl(file.get(), F_OFD_GETLK, &held) == 0 && held.l_type != F_UNLCK;
}

}  // namespace forgescan
