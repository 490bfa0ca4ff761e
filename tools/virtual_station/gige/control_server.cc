#include "tools/virtual_station/gige/control_server.h"

#include <poll.h>
#include <sys/socket.h>

#include <array>

#include "tools/virtual_station/gige/bytes.h"
#include "tools/virtual_station/gige/mono_time.h"

namespace forgescan::gige {
namespace {

constexpr int kPoll_ms = 20;  // granularity of heartbeat expiry, reboot and shutdown
constexpr std::size_t kMaxDatagram_bytes = 1500;
constexpr std::int64_t kNsPerMs = 1'000'000;
constexpr std::uint32_t kBroadcastAddress = 0xffffffff;

bool Aligned(std::uint32_t address) { return address % 4 == 0; }

}  // namespace

Result<std::unique_ptr<ControlServer>> ControlServer::Create(std::uint32_t address, RegisterFile& registers,
                                                             ControlHooks hooks) {
  std::unique_ptr<ControlServer> server(new ControlServer(registers, std::move(hooks)));
  ASSIGN_OR_RETURN(server->socket_, UdpSocket::Bind(address, kGvcpPort, false));
  ASSIGN_OR_RETURN(server->broadcast_socket_, UdpSocket::Bind(kBroadcastAddress, kGvcpPort, true));
  server->thread_ = std::thread([self = server.get()] { self->Run(); });
  return server;
}

ControlServer::~ControlServer() {
  stop_ = true;
  if (thread_.joinable()) {
    thread_.join();
  }
}

void ControlServer::Reboot(std::int64_t duration_ns) { reboot_ns_ = std::max<std::int64_t>(duration_ns, 1); }

ControlCounters ControlServer::counters() const {
  return {commands_, malformed_, refused_, heartbeats_expired_};
}

void ControlServer::Run() {
  while (!stop_) {
    std::array<pollfd, 2> polled{{{socket_.fd(), POLLIN, 0}, {broadcast_socket_.fd(), POLLIN, 0}}};
    if (::poll(polled.data(), polled.size(), kPoll_ms) > 0) {
      for (const pollfd& ready : polled) {
        if ((ready.revents & POLLIN) != 0) {
          Receive(ready.fd);
        }
      }
    }
    CheckDeadlines();
  }
}

void ControlServer::Receive(int fd) {
  std::array<std::uint8_t, kMaxDatagram_bytes> buffer;
  sockaddr_in sender{};
  socklen_t sender_bytes = sizeof sender;
  const ssize_t received = ::recvfrom(fd, buffer.data(), buffer.size(), MSG_DONTWAIT,
                                      reinterpret_cast<sockaddr*>(&sender), &sender_bytes);
  if (received > 0) {
    Handle(std::span(buffer).first(static_cast<std::size_t>(received)), sender);
  }
}

void ControlServer::CheckDeadlines() {
  const std::int64_t now_ns = MonoNowNs();
  if (const std::int64_t reboot_ns = reboot_ns_.exchange(0); reboot_ns > 0) {
    silent_until_ns_ = now_ns + reboot_ns;
    Release();
    registers_.Reset();
  }
  if (controller_ && now_ns > heartbeat_deadline_ns_) {
    ++heartbeats_expired_;
    Release();
  }
}

void ControlServer::Handle(std::span<const std::uint8_t> datagram, const sockaddr_in& sender) {
  if (muted_ || MonoNowNs() < silent_until_ns_) {
    return;
  }
  const auto command = ParseGvcpCommand(datagram);
  if (!command.ok()) {
    ++malformed_;
    return;
  }
  ++commands_;
  const Peer peer{ntohl(sender.sin_addr.s_addr), ntohs(sender.sin_port)};
  const Reply reply = Answer(*command, peer);
  refused_ += reply.status == GvcpStatus::kSuccess ? 0U : 1U;
  if (controller_ == peer) {
    heartbeat_deadline_ns_ = MonoNowNs() + registers_.Get(reg::kHeartbeatTimeout) * kNsPerMs;
  }
  if (command->wants_acknowledge && command->operation != GvcpOperation::kPacketResend) {
    const auto bytes = MakeGvcpAcknowledge(*command, reply.status, reply.payload);
    // An answer that the system does not take is a lost datagram, which the client repeats.
    [[maybe_unused]] const ssize_t sent = ::sendto(socket_.fd(), bytes.data(), bytes.size(), 0,
                                                   reinterpret_cast<const sockaddr*>(&sender), sizeof sender);
  }
}

ControlServer::Reply ControlServer::Answer(const GvcpCommand& command, const Peer& peer) {
  switch (command.operation) {
    case GvcpOperation::kDiscovery:
      return {GvcpStatus::kSuccess, *registers_.Read(0, kDiscovery_bytes)};
    case GvcpOperation::kReadRegister:
      return ReadRegisters(command);
    case GvcpOperation::kWriteRegister:
      return WriteRegisters(command, peer);
    case GvcpOperation::kReadMemory:
      return ReadMemory(command);
    case GvcpOperation::kWriteMemory:
      return WriteMemory(command, peer);
    case GvcpOperation::kPacketResend: {
      if ((registers_.Get(reg::kGvcpCapability) & kCapabilityResend) == 0) {
        return {GvcpStatus::kNotImplemented, {}};
      }
      const auto request = ParseResendRequest(command);
      if (!request.ok()) {
        return {GvcpStatus::kInvalidParameter, {}};
      }
      hooks_.resend(*request);
      return {};
    }
  }
  return {GvcpStatus::kNotImplemented, {}};
}

ControlServer::Reply ControlServer::ReadRegisters(const GvcpCommand& command) const {
  Reply reply;
  if (command.payload.empty() || command.payload.size() % 4 != 0) {
    return {GvcpStatus::kInvalidParameter, {}};
  }
  for (std::size_t at = 0; at < command.payload.size(); at += 4) {
    const std::uint32_t address = Get32(command.payload, at);
    if (!Aligned(address)) {
      return {GvcpStatus::kBadAlignment, std::move(reply.payload)};
    }
    const auto bytes = registers_.Read(address, 4);
    if (!bytes) {
      return {GvcpStatus::kInvalidAddress, std::move(reply.payload)};
    }
    reply.payload.insert(reply.payload.end(), bytes->begin(), bytes->end());
  }
  return reply;
}

ControlServer::Reply ControlServer::WriteRegisters(const GvcpCommand& command, const Peer& peer) {
  Reply reply{GvcpStatus::kSuccess, std::vector<std::uint8_t>(4)};
  if (command.payload.empty() || command.payload.size() % 8 != 0) {
    return {GvcpStatus::kInvalidParameter, {}};
  }
  for (std::size_t at = 0; at < command.payload.size(); at += 8) {
    reply.status = WriteOne(Get32(command.payload, at), Get32(command.payload, at + 4), peer);
    if (reply.status != GvcpStatus::kSuccess) {
      return reply;
    }
    Put16(reply.payload, 2, static_cast<std::uint32_t>(at / 8 + 1));
  }
  return reply;
}

ControlServer::Reply ControlServer::ReadMemory(const GvcpCommand& command) const {
  constexpr std::uint32_t kMaxRead_bytes = 536;
  if (command.payload.size() < 8) {
    return {GvcpStatus::kInvalidParameter, {}};
  }
  const std::uint32_t address = Get32(command.payload, 0);
  const std::uint32_t size_bytes = Get16(command.payload, 6);
  const auto bytes = registers_.Read(address, size_bytes);
  if (size_bytes > kMaxRead_bytes) {
    return {GvcpStatus::kInvalidParameter, {}};
  }
  if (!bytes) {
    return {GvcpStatus::kInvalidAddress, {}};
  }
  Reply reply;
  Append32(reply.payload, address);
  reply.payload.insert(reply.payload.end(), bytes->begin(), bytes->end());
  return reply;
}

ControlServer::Reply ControlServer::WriteMemory(const GvcpCommand& command, const Peer& peer) {
  if (command.payload.size() < 8 || command.payload.size() % 4 != 0) {
    return {GvcpStatus::kInvalidParameter, {}};
  }
  Reply reply{GvcpStatus::kSuccess, std::vector<std::uint8_t>(4)};
  const std::uint32_t address = Get32(command.payload, 0);
  for (std::uint32_t at = 4; at < command.payload.size(); at += 4) {
    reply.status = WriteOne(address + at - 4, Get32(command.payload, at), peer);
    if (reply.status != GvcpStatus::kSuccess) {
      return reply;
    }
    Put16(reply.payload, 2, at);
  }
  return reply;
}

GvcpStatus ControlServer::WriteOne(std::uint32_t address, std::uint32_t value, const Peer& peer) {
  if (!Aligned(address)) {
    return GvcpStatus::kBadAlignment;
  }
  if (address == reg::kControlPrivilege) {
    return WritePrivilege(value, peer);
  }
  if (controller_ != peer) {
    return GvcpStatus::kAccessDenied;
  }
  const GvcpStatus status = registers_.Write(address, value);
  if (status == GvcpStatus::kSuccess) {
    hooks_.written(address, value);
  }
  return status;
}

GvcpStatus ControlServer::WritePrivilege(std::uint32_t value, const Peer& peer) {
  if (controller_ && controller_ != peer) {
    return GvcpStatus::kAccessDenied;
  }
  if ((value & kPrivilegeMask) == 0) {
    Release();
    return GvcpStatus::kSuccess;
  }
  controller_ = peer;
  registers_.Set(reg::kControlPrivilege, value & kPrivilegeMask);
  return GvcpStatus::kSuccess;
}

void ControlServer::Release() {
  controller_.reset();
  registers_.Set(reg::kControlPrivilege, 0);
  registers_.Set(reg::kAcquisition, 0);
  registers_.Set(reg::kStreamPort, 0);
  hooks_.released();
}

}  // namespace forgescan::gige
