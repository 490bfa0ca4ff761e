#include "tools/virtual_station/gige/gige_device.h"

#include <arpa/inet.h>
#include <sys/socket.h>

#include <algorithm>
#include <utility>

#include "tools/virtual_station/gige/control_server.h"
#include "tools/virtual_station/gige/registers.h"
#include "tools/virtual_station/gige/sensor.h"
#include "tools/virtual_station/gige/socket.h"
#include "tools/virtual_station/gige/transmitter.h"

namespace forgescan {
namespace {

using gige::ControlHooks;
using gige::ControlServer;
using gige::RegisterFile;
using gige::Sensor;
using gige::Transmitter;
using gige::UdpSocket;
namespace reg = gige::reg;

constexpr int kMaxSide_px = 65532;

Result<std::uint32_t> ParseAddress(const std::string& text) {
  in_addr parsed{};
  if (::inet_pton(AF_INET, text.c_str(), &parsed) != 1) {
    return Fail(ErrorCode::kInvalidArgument, "virtual camera: \"{}\" is not an IPv4 address", text);
  }
  return std::uint32_t{ntohl(parsed.s_addr)};
}

Status Check(const GigeDeviceConfig& config) {
  for (const int side_px : {config.width_px, config.height_px}) {
    if (side_px < 16 || side_px > kMaxSide_px || side_px % 4 != 0) {
      return Fail(ErrorCode::kInvalidArgument,
                  "virtual camera: sensor of {} x {} px, sides must be 16..{} in steps of 4", config.width_px,
                  config.height_px, kMaxSide_px);
    }
  }
  if (!config.image || config.first_block_id == 0) {
    return Fail(ErrorCode::kInvalidArgument, "virtual camera: {}",
                config.image ? "first_block_id is 0, must be 1..65535" : "no image source");
  }
  return {};
}

}  // namespace

// Members in the order of destruction's reverse: the control server ends first, as it calls the others.
class GigeDevice::Impl {
 public:
  Impl(const GigeDeviceConfig& config, std::uint32_t address, UdpSocket stream_socket)
      : registers_({config.vendor, config.model, config.serial, config.user_name, config.mac, address},
                   static_cast<std::uint32_t>(config.width_px), static_cast<std::uint32_t>(config.height_px),
                   config.offers_resend),
        stream_socket_(std::move(stream_socket)),
        transmitter_(stream_socket_.fd(), {config.rate_mbit_s, config.link, config.seed}),
        sensor_(registers_,
                {static_cast<std::uint32_t>(config.width_px), static_cast<std::uint32_t>(config.height_px),
                 config.first_block_id, config.seed + 1, config.image,
                 [this](std::shared_ptr<const gige::GvspFrame> frame) {
                   return transmitter_.Submit(std::move(frame));
                 }}) {
    registers_.Set(reg::kStreamSourcePort, stream_socket_.port());
  }

  Status Listen(std::uint32_t address) {
    ControlHooks hooks;
    hooks.written = [this](std::uint32_t changed, std::uint32_t value) { OnWritten(changed, value); };
    hooks.released = [this] { Forget(); };
    hooks.resend = [this](const gige::ResendRequest& request) { transmitter_.RequestResend(request); };
    ASSIGN_OR_RETURN(control_, ControlServer::Create(address, registers_, std::move(hooks)));
    return {};
  }

  void OnWritten(std::uint32_t address, std::uint32_t value) {
    if (address == reg::kAcquisition) {
      Forget();
    }
    if (address == reg::kStreamPacketSize && (value & gige::kFireTestPacket) != 0) {
      SendTestPacket();
    }
  }

  void Forget() {
    sensor_.Restart();
    transmitter_.Forget();
  }

  // One packet of the stream's size, so that the client learns whether the path carries it. Not fragmented,
  // therefore.
  void SendTestPacket() {
    const gige::AcquisitionSettings settings = registers_.settings();
    const std::vector<std::uint8_t> bytes(settings.packet_size_bytes - gige::kIpUdpHeader_bytes);
    const int dont_fragment = IP_PMTUDISC_DO;
    ::setsockopt(stream_socket_.fd(), IPPROTO_IP, IP_MTU_DISCOVER, &dont_fragment, sizeof dont_fragment);
    // A packet that the path refuses is the very answer the client waits for.
    [[maybe_unused]] const ssize_t sent =
        ::sendto(stream_socket_.fd(), bytes.data(), bytes.size(), 0,
                 reinterpret_cast<const sockaddr*>(&settings.target), sizeof settings.target);
  }

  RegisterFile registers_;
  UdpSocket stream_socket_;
  Transmitter transmitter_;
  Sensor sensor_;
  std::unique_ptr<ControlServer> control_;
};

GigeDevice::GigeDevice(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
GigeDevice::~GigeDevice() = default;

Result<std::unique_ptr<GigeDevice>> GigeDevice::Create(GigeDeviceConfig config) {
  RETURN_IF_ERROR(Check(config));
  ASSIGN_OR_RETURN(const std::uint32_t address, ParseAddress(config.address));
  ASSIGN_OR_RETURN(UdpSocket stream_socket, UdpSocket::Bind(address, 0, false));
  auto impl = std::make_unique<Impl>(config, address, std::move(stream_socket));
  RETURN_IF_ERROR(impl->Listen(address));
  return std::unique_ptr<GigeDevice>(new GigeDevice(std::move(impl)));
}

void GigeDevice::Edge(std::int64_t t_mono_ns, std::uint64_t tag) { impl_->sensor_.Edge(t_mono_ns, tag); }

void GigeDevice::SetFaults(const GigeFaults& faults) {
  impl_->sensor_.SetFaults(faults.lost_trigger_chance, faults.dropped_frame_chance);
  impl_->transmitter_.SetFaults(faults.packet_loss_chance, faults.resend_unavailable);
  impl_->control_->SetMuted(faults.control_silent);
}

void GigeDevice::Reboot(std::int64_t duration_ms) { impl_->control_->Reboot(duration_ms * 1'000'000); }

bool GigeDevice::armed() const {
  const gige::AcquisitionSettings settings = impl_->registers_.settings();
  return settings.acquiring && settings.line_triggered;
}

GigeCounters GigeDevice::counters() const {
  GigeCounters counters = impl_->sensor_.counters();
  const gige::TransmitterCounters sent = impl_->transmitter_.counters();
  counters.frames_sent = sent.frames;
  counters.packets_sent = sent.packets;
  counters.packets_lost = sent.packets_lost;
  counters.packets_refused = sent.packets_refused;
  counters.packets_failed = sent.packets_failed;
  counters.resends = sent.packets_resent;
  counters.resends_unavailable = sent.resends_unavailable;
  const gige::ControlCounters control = impl_->control_->counters();
  counters.commands = control.commands;
  counters.commands_malformed = control.malformed;
  counters.commands_refused = control.refused;
  counters.heartbeats_expired = control.heartbeats_expired;
  return counters;
}

}  // namespace forgescan
