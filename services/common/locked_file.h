// A file that one process at a time may hold.
#pragma once

#include <string>
#include <utility>

#include "services/common/result.h"

namespace forgescan {

// A file descriptor, closed with the object.
class OwnedFd {
 public:
  explicit OwnedFd(int fd) : fd_(fd) {}
  OwnedFd(OwnedFd&& other) noexcept : fd_(std::exchange(other.fd_, -1)) {}
  OwnedFd& operator=(OwnedFd&&) = delete;
  ~OwnedFd();
  int get() const { return fd_; }

 private:
  int fd_;
};

// The file, made if it is not there, under a lock that ends with the descriptor: also when the process dies.
// Errors: kUnavailable (somebody else holds it), kIo (no such file can be made, or none be locked here).
Result<OwnedFd> LockFile(const std::string& path);
// Whether somebody else holds the open file.
bool IsLockedByAnother(const OwnedFd& file);

}  // namespace forgescan
