// ControlServer: answers GVCP on the camera's address: discovery, control privilege with heartbeat,
// registers, resends.
#pragma once

#include <netinet/in.h>

#include <atomic>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <thread>

#include "services/common/result.h"
#include "tools/virtual_station/gige/gvcp.h"
#include "tools/virtual_station/gige/registers.h"
#include "tools/virtual_station/gige/socket.h"

namespace forgescan::gige {

// What the rest of the camera does about it; called on the control thread.
struct ControlHooks {
  std::function<void(std::uint32_t address, std::uint32_t value)> written;  // a client changed a register
  std::function<void()> released;  // nobody controls the camera any more
  std::function<void(const ResendRequest&)> resend;
};

struct ControlCounters {
  std::uint64_t commands = 0;
  std::uint64_t malformed = 0;
  std::uint64_t refused = 0;  // answered with an error
  std::uint64_t heartbeats_expired = 0;
};

class ControlServer {
 public:
  // Errors: kIo if the address cannot be bound (there is one camera per address, the port is fixed).
  static Result<std::unique_ptr<ControlServer>> Create(std::uint32_t address, RegisterFile& registers,
                                                       ControlHooks hooks);
  ~ControlServer();

  // Stops answering, as a camera whose control processor hangs.
  void SetMuted(bool muted) { muted_ = muted; }
  // Forgets everything and is silent for a while, as after a power cut.
  void Reboot(std::int64_t duration_ns);
  ControlCounters counters() const;

 private:
  struct Peer {
    std::uint32_t address;
    std::uint16_t port;
    bool operator==(const Peer&) const = default;
  };
  struct Reply {
    GvcpStatus status = GvcpStatus::kSuccess;
    std::vector<std::uint8_t> payload;
  };

  ControlServer(RegisterFile& registers, ControlHooks hooks)
      : registers_(registers), hooks_(std::move(hooks)) {}
  void Run();
  void Receive(int fd);
  void CheckDeadlines();
  void Handle(std::span<const std::uint8_t> datagram, const sockaddr_in& sender);
  Reply Answer(const GvcpCommand& command, const Peer& peer);
  Reply ReadRegisters(const GvcpCommand& command) const;
  Reply WriteRegisters(const GvcpCommand& command, const Peer& peer);
  Reply ReadMemory(const GvcpCommand& command) const;
  Reply WriteMemory(const GvcpCommand& command, const Peer& peer);
  GvcpStatus WriteOne(std::uint32_t address, std::uint32_t value, const Peer& peer);
  GvcpStatus WritePrivilege(std::uint32_t value, const Peer& peer);
  void Release();

  RegisterFile& registers_;
  const ControlHooks hooks_;
  UdpSocket socket_;
  UdpSocket broadcast_socket_;
  std::optional<Peer> controller_;           // control thread only
  std::int64_t heartbeat_deadline_ns_ = 0;   // control thread only
  std::int64_t silent_until_ns_ = 0;         // control thread only
  std::atomic<std::int64_t> reboot_ns_ = 0;  // a wish from another thread; 0 = none
  std::atomic<bool> muted_ = false;
  std::atomic<bool> stop_ = false;
  std::atomic<std::uint64_t> commands_ = 0, malformed_ = 0, refused_ = 0, heartbeats_expired_ = 0;
  std::thread thread_;
};

}  // namespace forgescan::gige
