#include "drivers/can/can_udp.h"

#include <arpa/inet.h>
#include <fcntl.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>

#include "drivers/can/can_msgpack.h"

namespace forgescan {
namespace {

constexpr int kReceiveBufferBytes = 1 << 20;  // some thousand frames, against a stalled reader
constexpr std::size_t kMaxDatagramBytes = 2048;
constexpr int kMaxFramesPerDrain = 4096;  // a babbling station must not hold the caller for ever

sockaddr_in AddressOf(in_addr host, std::uint16_t port) {
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(port);
  address.sin_addr = host;
  return address;
}

template <typename T>
bool SetOption(int fd, int level, int name, T value) {
  return ::setsockopt(fd, level, name, &value, sizeof(value)) == 0;
}

// A second socket sends, on a port of its own: that port is how a bus recognises, and drops, what it sent
// itself.
class UdpCan final : public CanBus {
 public:
  UdpCan(const UdpCanConfig& config, TimeSource now_us) : config_(config), now_us_(std::move(now_us)) {}
  ~UdpCan() override {
    for (const int fd : {receive_fd_, send_fd_}) {
      if (fd >= 0) {
        ::close(fd);
      }
    }
  }

  Status Open();
  Status Send(const CanFrame& frame) override;
  Status Drain() override;
  int fd() const override { return receive_fd_; }

 private:
  Status OpenReceiver(in_addr group);
  Status OpenSender(in_addr group);
  Error SystemError(const char* what) const {
    return Fail(ErrorCode::kUnavailable, "udp CAN {}:{}: {}: {}", config_.group, config_.port, what,
                std::strerror(errno));
  }

  UdpCanConfig config_;
  TimeSource now_us_;
  int receive_fd_ = -1;
  int send_fd_ = -1;
  sockaddr_in own_{};
};

Status UdpCan::OpenReceiver(in_addr group) {
  receive_fd_ = ::socket(AF_INET, SOCK_DGRAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0);
  if (receive_fd_ < 0) {
    return SystemError("no socket");
  }
  const sockaddr_in address = AddressOf(group, config_.port);
  const bool ready =
      SetOption(receive_fd_, SOL_SOCKET, SO_REUSEADDR, 1) &&
      SetOption(receive_fd_, SOL_SOCKET, SO_RCVBUF, kReceiveBufferBytes) &&
      ::bind(receive_fd_, reinterpret_cast<const sockaddr*>(&address), sizeof(address)) == 0 &&
      SetOption(receive_fd_, IPPROTO_IP, IP_ADD_MEMBERSHIP, ip_mreq{group, in_addr{htonl(INADDR_ANY)}});
  return ready ? Status() : Status(SystemError("cannot join the group"));
}

Status UdpCan::OpenSender(in_addr group) {
  send_fd_ = ::socket(AF_INET, SOCK_DGRAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0);
  if (send_fd_ < 0) {
    return SystemError("no socket");
  }
  const sockaddr_in target = AddressOf(group, config_.port);
  socklen_t size = sizeof(own_);
  const bool ready = SetOption(send_fd_, IPPROTO_IP, IP_MULTICAST_TTL, config_.hop_limit) &&
                     SetOption(send_fd_, IPPROTO_IP, IP_MULTICAST_LOOP, 1) &&
                     ::connect(send_fd_, reinterpret_cast<const sockaddr*>(&target), sizeof(target)) == 0 &&
                     ::getsockname(send_fd_, reinterpret_cast<sockaddr*>(&own_), &size) == 0;
  return ready ? Status() : Status(SystemError("no route to the group"));
}

Status UdpCan::Open() {
  in_addr group{};
  ::inet_pton(AF_INET, config_.group.c_str(), &group);
  RETURN_IF_ERROR(OpenReceiver(group));
  return OpenSender(group);
}

Status UdpCan::Send(const CanFrame& frame) {
  Status sendable = CheckSendable(frame);
  if (!sendable.ok()) {
    ++counters_.send_failures;
    return sendable;
  }
  const std::vector<std::uint8_t> bytes = EncodeCanDatagram(frame, now_us_());
  if (::send(send_fd_, bytes.data(), bytes.size(), 0) != static_cast<ssize_t>(bytes.size())) {
    ++counters_.send_failures;
    return SystemError("frame not sent");
  }
  ++counters_.sent;
  return {};
}

Status UdpCan::Drain() {
  std::array<std::uint8_t, kMaxDatagramBytes> buffer;
  for (int count = 0; count < kMaxFramesPerDrain; ++count) {
    sockaddr_in sender{};
    socklen_t size = sizeof(sender);
    const ssize_t got =
        ::recvfrom(receive_fd_, buffer.data(), buffer.size(), 0, reinterpret_cast<sockaddr*>(&sender), &size);
    if (got < 0) {
      const bool waiting_is_over = errno == EAGAIN || errno == EWOULDBLOCK || errno == EINTR;
      return waiting_is_over ? Status() : Status(SystemError("cannot receive"));
    }
    if (sender.sin_port == own_.sin_port && sender.sin_addr.s_addr == own_.sin_addr.s_addr) {
      continue;
    }
    auto frame = DecodeCanDatagram(std::span(buffer).first(static_cast<std::size_t>(got)));
    if (!frame.ok()) {
      ++counters_.malformed;
      continue;
    }
    frame->utime = now_us_();
    Deliver(*frame);
  }
  return {};
}

}  // namespace

Status UdpCanConfig::Check() const {
  in_addr address{};
  if (::inet_pton(AF_INET, group.c_str(), &address) != 1 || !IN_MULTICAST(ntohl(address.s_addr))) {
    return Fail(ErrorCode::kInvalidArgument,
                "udp CAN group '{}' is not an IPv4 multicast address (224.0.0.0/4)", group);
  }
  if (port == 0) {
    return Fail(ErrorCode::kInvalidArgument, "udp CAN port 0 is outside 1..65535");
  }
  if (hop_limit < 0 || hop_limit > 32) {
    return Fail(ErrorCode::kInvalidArgument, "udp CAN hop limit {} is outside 0..32", hop_limit);
  }
  return {};
}

Result<std::unique_ptr<CanBus>> OpenUdpCan(const UdpCanConfig& config, TimeSource now_us) {
  RETURN_IF_ERROR(config.Check());
  auto bus = std::make_unique<UdpCan>(config, std::move(now_us));
  RETURN_IF_ERROR(bus->Open());
  return std::unique_ptr<CanBus>(std::move(bus));
}

}  // namespace forgescan
