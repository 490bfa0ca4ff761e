// What a service tells systemd: that it works, that it still does, that it stops. The datagram protocol of
// sd_notify(3), without its library.
#pragma once

#include <string>

#include "services/common/result.h"

namespace forgescan {

class ServiceManager {
 public:
  // `address` as in $NOTIFY_SOCKET: a path, or a name that begins with @ (abstract). Empty: nobody asked, and
  // Notify() does nothing. Errors: kInvalidArgument (neither form, or too long), kIo (no socket).
  static Result<ServiceManager> Connect(const std::string& address);
  ServiceManager(ServiceManager&& other) noexcept;
  ServiceManager& operator=(ServiceManager&&) = delete;
  ~ServiceManager();

  // Sends assignments such as "READY=1", one a line. Never waits. Errors: kIo (nobody listens, or it is
  // full).
  Status Notify(const std::string& assignments) const;

 private:
  ServiceManager(std::string address, int fd) : address_(std::move(address)), fd_(fd) {}

  std::string address_;
  int fd_ = -1;  // -1: nobody asked
};

// "STATUS=text" as one line: what would end the line early is a blank.
std::string StatusLine(std::string text);

}  // namespace forgescan
