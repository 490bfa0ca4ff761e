#include "tools/virtual_station/gige/socket.h"

#include <sys/socket.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>

namespace forgescan::gige {

UdpSocket::~UdpSocket() {
  if (fd_ >= 0) {
    ::close(fd_);
  }
}

Result<UdpSocket> UdpSocket::Bind(std::uint32_t address, std::uint16_t port, bool shared) {
  UdpSocket socket;
  socket.fd_ = ::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
  if (socket.fd_ < 0) {
    return Fail(ErrorCode::kIo, "virtual camera: no UDP socket: {}", std::strerror(errno));
  }
  const int yes = 1;
  if (shared && (::setsockopt(socket.fd_, SOL_SOCKET, SO_REUSEADDR, &yes, sizeof yes) != 0 ||
                 ::setsockopt(socket.fd_, SOL_SOCKET, SO_BROADCAST, &yes, sizeof yes) != 0)) {
    return Fail(ErrorCode::kIo, "virtual camera: cannot share a UDP port: {}", std::strerror(errno));
  }
  sockaddr_in own{};
  own.sin_family = AF_INET;
  own.sin_addr.s_addr = htonl(address);
  own.sin_port = htons(port);
  if (::bind(socket.fd_, reinterpret_cast<const sockaddr*>(&own), sizeof own) != 0) {
    return Fail(ErrorCode::kIo, "virtual camera: cannot bind {}.{}.{}.{}:{}: {}", address >> 24,
                address >> 16 & 255, address >> 8 & 255, address & 255, port, std::strerror(errno));
  }
  return socket;
}

std::uint16_t UdpSocket::port() const {
  sockaddr_in own{};
  socklen_t size = sizeof own;
  return ::getsockname(fd_, reinterpret_cast<sockaddr*>(&own), &size) == 0 ? ntohs(own.sin_port) : 0;
}

}  // namespace forgescan::gige
