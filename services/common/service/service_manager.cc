#include "services/common/service/service_manager.h"

#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <algorithm>
#include <cctype>
#include <cerrno>
#include <cstddef>
#include <cstring>
#include <utility>

namespace forgescan {

Result<ServiceManager> ServiceManager::Connect(const std::string& address) {
  if (address.empty()) {
    return ServiceManager("", -1);
  }
  constexpr std::size_t kLongest = sizeof(sockaddr_un::sun_path) - 1;
  const bool formed = (address[0] == '/' || address[0] == '@') && address.size() > 1;
  if (!formed || address.size() > kLongest) {
    return Fail(ErrorCode::kInvalidArgument,
                "NOTIFY_SOCKET is \"{}\", must be a path or @NAME of at most {} characters", address,
                kLongest);
  }
  sockaddr_un to{};
  to.sun_family = AF_UNIX;
  std::memcpy(to.sun_path, address.data(), address.size());
  if (address[0] == '@') {
    to.sun_path[0] = '\0';  // an abstract name
  }
  const auto size = static_cast<socklen_t>(offsetof(sockaddr_un, sun_path) + address.size());
  const int fd = socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
  if (fd < 0 || connect(fd, reinterpret_cast<const sockaddr*>(&to), size) != 0) {
    const int problem = errno;
    close(fd);
    return Fail(ErrorCode::kIo, "NOTIFY_SOCKET {}: {}", address, std::strerror(problem));
  }
  return ServiceManager(address, fd);
}

ServiceManager::ServiceManager(ServiceManager&& other) noexcept
    : address_(std::move(other.address_)), fd_(std::exchange(other.fd_, -1)) {}

ServiceManager::~ServiceManager() {
  if (fd_ >= 0) {
    close(fd_);
  }
}

Status ServiceManager::Notify(const std::string& assignments) const {
  if (fd_ < 0) {
    return {};
  }
  const auto size = static_cast<ssize_t>(assignments.size());
  if (send(fd_, assignments.data(), assignments.size(), MSG_NOSIGNAL) != size) {
    return Fail(ErrorCode::kIo, "NOTIFY_SOCKET {}: {}", address_, std::strerror(errno));
  }
  return {};
}

std::string StatusLine(std::string text) {
  std::replace_if(
      text.begin(), text.end(), [](unsigned char c) { return std::iscntrl(c) != 0; }, ' ');
  return "STATUS=" + text;
}

}  // namespace forgescan
