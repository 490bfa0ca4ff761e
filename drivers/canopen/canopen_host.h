// A device on the CAN bus, seen from the host: any Device whose wire format is a Protocol.
//
// A Protocol has Command and Event types, kNode, kObjects (what to read when the link comes up), and
//   Result<std::vector<CanFrame>> FramesOf(const Command&);        // host to device
//   Result<std::optional<Event>> EventOf(const CanFrame&);         // nothing: not a frame of this device
//   std::optional<Event> EventOfObjects(const std::map<canopen::ObjectAddress, std::uint32_t>&);
#pragma once

#include <string>

#include "drivers/canopen/canopen_peer.h"
#include "drivers/device.h"

namespace forgescan {

template <typename Protocol>
class CanopenHost final : public Device<typename Protocol::Command, typename Protocol::Event> {
 public:
  using Command = typename Protocol::Command;
  using Event = typename Protocol::Event;

  // The bus must live as long as this object, and this object as long as the bus is drained.
  explicit CanopenHost(CanBus& bus)
      : bus_(bus), peer_(Protocol::kNode, {Protocol::kObjects.begin(), Protocol::kObjects.end()}) {
    bus_.AddHandler([this](const CanFrame& frame) { OnFrame(frame); });
  }

  // Errors: also kUnavailable while the link is down.
  Status Send(const Command& command) override {
    if (!peer_.up()) {
      return Fail(ErrorCode::kUnavailable, "CAN node {:#x} is not up: order not sent", Protocol::kNode);
    }
    ASSIGN_OR_RETURN(const auto frames, protocol_.FramesOf(command));
    return SendAll(frames);
  }

  void Step(std::int64_t now_us) override { Handle(peer_.Step(now_us)); }

  // Frames of this device that broke the protocol, and the newest reason.
  std::uint64_t bad_frames() const { return bad_frames_; }
  const std::string& last_bad_frame() const { return last_bad_frame_; }

 private:
  Status SendAll(const std::vector<CanFrame>& frames) {
    for (const CanFrame& frame : frames) {
      RETURN_IF_ERROR(bus_.Send(frame));
    }
    return {};
  }

  void OnFrame(const CanFrame& frame) {
    if (frame.error) {
      return;
    }
    Handle(peer_.OnFrame(frame, frame.utime));
    const auto event = protocol_.EventOf(frame);
    if (!event.ok()) {
      ++bad_frames_;
      last_bad_frame_ = event.error().message;
    } else if (event->has_value() && peer_.up()) {
      this->Emit(**event);
    }
  }

  void Handle(const canopen::PeerOutput& output) {
    if (const Status sent = SendAll(output.frames); !sent.ok()) {
      last_bad_frame_ =
          sent.error().message;  // the peer asks again: start at the next heartbeat, objects after a timeout
    }
    for (const auto& event : output.events) {
      if (const auto* emergency = std::get_if<canopen::Emergency>(&event)) {
        this->Emit(DeviceFault{emergency->code, emergency->detail});
        continue;
      }
      this->Emit(DeviceLink{std::get<canopen::LinkChange>(event).up});
      if (const auto objects = protocol_.EventOfObjects(peer_.objects()); objects && peer_.up()) {
        this->Emit(*objects);
      }
    }
  }

  CanBus& bus_;
  canopen::CanopenPeer peer_;
  Protocol protocol_;
  std::uint64_t bad_frames_ = 0;
  std::string last_bad_frame_;
};

}  // namespace forgescan
