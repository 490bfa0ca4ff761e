// Owned UDP socket.
#pragma once

#include <netinet/in.h>

#include <cstdint>
#include <utility>

#include "services/common/result.h"

namespace forgescan::gige {

class UdpSocket {
 public:
  UdpSocket() = default;
  UdpSocket(UdpSocket&& other) noexcept : fd_(std::exchange(other.fd_, -1)) {}
  UdpSocket& operator=(UdpSocket&& other) noexcept {
    std::swap(fd_, other.fd_);
    return *this;
  }
  ~UdpSocket();

  // Binds address:port (host byte order; port 0: any). `shared`: several sockets may bind it, for broadcasts.
  static Result<UdpSocket> Bind(std::uint32_t address, std::uint16_t port, bool shared);

  int fd() const { return fd_; }
  std::uint16_t port() const;

 private:
  int fd_ = -1;
};

}  // namespace forgescan::gige
