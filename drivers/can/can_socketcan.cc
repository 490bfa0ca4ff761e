#include "drivers/can/can_socketcan.h"

#include <linux/can.h>
#include <linux/can/error.h>
#include <linux/can/raw.h>
#include <net/if.h>
#include <poll.h>
#include <sys/ioctl.h>
#include <sys/socket.h>
#include <sys/time.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <deque>
#include <optional>

namespace forgescan {
namespace {

constexpr int kMaxFramesPerDrain = 4096;  // a babbling station must not hold the caller for ever

can_frame ToKernel(const CanFrame& frame) {
  can_frame raw{};
  raw.can_id = frame.id | (frame.extended ? CAN_EFF_FLAG : 0U) | (frame.rtr ? CAN_RTR_FLAG : 0U);
  raw.can_dlc = frame.length;
  std::memcpy(raw.data, frame.data.data(), frame.rtr ? 0 : frame.length);
  return raw;
}

CanFrame FromKernel(const can_frame& raw, std::int64_t utime) {
  CanFrame frame;
  frame.extended = (raw.can_id & CAN_EFF_FLAG) != 0;
  frame.rtr = (raw.can_id & CAN_RTR_FLAG) != 0;
  frame.error = (raw.can_id & CAN_ERR_FLAG) != 0;
  frame.id = raw.can_id & (frame.extended || frame.error ? CAN_EFF_MASK : CAN_SFF_MASK);
  frame.length = raw.can_dlc;
  std::memcpy(frame.data.data(), raw.data, frame.rtr ? 0 : frame.length);
  frame.utime = utime;
  return frame;
}

class SocketCan final : public CanBus {
 public:
  SocketCan(SocketCanConfig config, TimeSource now_us)
      : config_(std::move(config)), now_us_(std::move(now_us)) {}
  ~SocketCan() override {
    if (fd_ >= 0) {
      ::close(fd_);
    }
  }

  Status Open();
  Status Send(const CanFrame& frame) override;
  Status Drain() override;
  Status SetFilters(std::vector<CanFilter> filters) override;
  int fd() const override { return fd_; }

 private:
  Status Bind(int interface_index);
  Status Write(const can_frame& raw);
  Result<std::optional<CanFrame>> Read();  // nothing when no frame waits
  void NoteBusOff(std::int64_t utime);
  Error SystemError(const char* what) const {
    return Fail(ErrorCode::kUnavailable, "SocketCAN {}: {}: {}", config_.interface, what,
                std::strerror(errno));
  }

  SocketCanConfig config_;
  TimeSource now_us_;
  int fd_ = -1;
  std::deque<std::int64_t> bus_offs_us_;
};

Status SocketCan::Open() {
  fd_ = ::socket(PF_CAN, SOCK_RAW | SOCK_NONBLOCK | SOCK_CLOEXEC, CAN_RAW);
  if (fd_ < 0) {
    return SystemError("this kernel gives no CAN socket (AF_CAN)");
  }
  const unsigned index = ::if_nametoindex(config_.interface.c_str());
  if (index == 0) {
    return SystemError("no such interface");
  }
  return Bind(static_cast<int>(index));
}

Status SocketCan::Bind(int interface_index) {
  const can_err_mask_t errors =
      CAN_ERR_BUSOFF | CAN_ERR_CRTL | CAN_ERR_TX_TIMEOUT | CAN_ERR_RESTARTED | CAN_ERR_ACK;
  const int on = 1;
  sockaddr_can address{};
  address.can_family = AF_CAN;
  address.can_ifindex = interface_index;
  const bool ready = ::setsockopt(fd_, SOL_CAN_RAW, CAN_RAW_ERR_FILTER, &errors, sizeof(errors)) == 0 &&
                     ::setsockopt(fd_, SOL_SOCKET, SO_TIMESTAMP, &on, sizeof(on)) == 0 &&
                     ::bind(fd_, reinterpret_cast<const sockaddr*>(&address), sizeof(address)) == 0;
  return ready ? Status() : Status(SystemError("cannot bind"));
}

// The kernel filters too, so that a service is not woken for the frames of others.
Status SocketCan::SetFilters(std::vector<CanFilter> filters) {
  std::vector<can_filter> raw;
  for (const CanFilter& filter : filters) {
    const canid_t kind = filter.extended ? CAN_EFF_FLAG : 0U;
    const canid_t bits = filter.extended ? CAN_EFF_MASK : CAN_SFF_MASK;
    raw.push_back({filter.id | kind, (filter.mask & bits) | CAN_EFF_FLAG});
  }
  if (raw.empty()) {
    raw.push_back({0, 0});
  }
  if (::setsockopt(fd_, SOL_CAN_RAW, CAN_RAW_FILTER, raw.data(),
                   static_cast<socklen_t>(raw.size() * sizeof(raw[0])))) {
    return SystemError("filters refused");
  }
  return CanBus::SetFilters(std::move(filters));
}

Status SocketCan::Write(const can_frame& raw) {
  for (int attempt = 0; attempt < 2; ++attempt) {
    if (::write(fd_, &raw, sizeof(raw)) == static_cast<ssize_t>(sizeof(raw))) {
      return {};
    }
    if (errno != ENOBUFS && errno != EAGAIN) {
      return SystemError("frame not sent");
    }
    pollfd writable{fd_, POLLOUT, 0};
    ::poll(&writable, 1, config_.send_wait_ms);
  }
  return SystemError("frame not sent, the transmit queue stays full");
}

Status SocketCan::Send(const CanFrame& frame) {
  Status status = CheckSendable(frame);
  if (status.ok() && static_cast<int>(bus_offs_us_.size()) >= config_.max_bus_offs) {
    status =
        Fail(ErrorCode::kUnavailable, "SocketCAN {}: {} bus-offs within {} s: check the wiring, then reopen",
             config_.interface, bus_offs_us_.size(), config_.bus_off_window_s);
  }
  if (status.ok()) {
    status = Write(ToKernel(frame));
  }
  ++(status.ok() ? counters_.sent : counters_.send_failures);
  return status;
}

// Once the limit is reached the times stay: only reopening, after a look at the wiring, clears them.
void SocketCan::NoteBusOff(std::int64_t utime) {
  ++counters_.bus_offs;
  if (static_cast<int>(bus_offs_us_.size()) >= config_.max_bus_offs) {
    return;
  }
  const auto window_us = static_cast<std::int64_t>(config_.bus_off_window_s * 1e6);
  while (!bus_offs_us_.empty() && bus_offs_us_.front() < utime - window_us) {
    bus_offs_us_.pop_front();
  }
  bus_offs_us_.push_back(utime);
}

Result<std::optional<CanFrame>> SocketCan::Read() {
  can_frame raw{};
  iovec part{&raw, sizeof(raw)};
  alignas(cmsghdr) std::array<char, 128> control;
  msghdr message{};
  message.msg_iov = &part;
  message.msg_iovlen = 1;
  message.msg_control = control.data();
  message.msg_controllen = control.size();
  const ssize_t got = ::recvmsg(fd_, &message, 0);
  if (got < 0 && (errno == EAGAIN || errno == EWOULDBLOCK || errno == EINTR)) {
    return std::optional<CanFrame>();
  }
  if (got != static_cast<ssize_t>(sizeof(raw)) || raw.can_dlc > 8) {
    return SystemError("cannot receive");
  }
  std::int64_t utime = now_us_();
  for (cmsghdr* entry = CMSG_FIRSTHDR(&message); entry != nullptr; entry = CMSG_NXTHDR(&message, entry)) {
    if (entry->cmsg_level == SOL_SOCKET && entry->cmsg_type == SO_TIMESTAMP) {
      timeval stamp{};
      std::memcpy(&stamp, CMSG_DATA(entry), sizeof(stamp));
      utime = static_cast<std::int64_t>(stamp.tv_sec) * 1'000'000 + stamp.tv_usec;
    }
  }
  return std::optional(FromKernel(raw, utime));
}

Status SocketCan::Drain() {
  for (int count = 0; count < kMaxFramesPerDrain; ++count) {
    ASSIGN_OR_RETURN(const auto frame, Read());
    if (!frame) {
      return {};
    }
    if (frame->error && (frame->id & CAN_ERR_BUSOFF) != 0) {
      NoteBusOff(frame->utime);
    }
    Deliver(*frame);
  }
  return {};
}

}  // namespace

Result<std::unique_ptr<CanBus>> OpenSocketCan(const SocketCanConfig& config, TimeSource now_us) {
  auto bus = std::make_unique<SocketCan>(config, std::move(now_us));
  RETURN_IF_ERROR(bus->Open());
  return std::unique_ptr<CanBus>(std::move(bus));
}

}  // namespace forgescan
