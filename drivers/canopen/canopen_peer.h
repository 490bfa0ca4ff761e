// The host's side of one CANopen node: brings it to operational, watches its heartbeat, reads its objects.
#pragma once

#include <map>
#include <variant>
#include <vector>

#include "drivers/canopen/canopen.h"

namespace forgescan::canopen {

struct LinkChange {
  bool up = false;
};
struct PeerOutput {
  std::vector<CanFrame> frames;  // to be sent
  std::vector<std::variant<LinkChange, Emergency>> events;
};

class CanopenPeer {
 public:
  // The link is up once the node is operational and every object of the list has been read.
  CanopenPeer(std::uint8_t node, std::vector<ObjectAddress> objects)
      : node_(node), wanted_(std::move(objects)) {}

  bool up() const { return up_; }
  const std::map<ObjectAddress, std::uint32_t>& objects() const { return read_; }

  // `now_us` is the time of the frame's delivery.
  PeerOutput OnFrame(const CanFrame& frame, std::int64_t now_us);
  PeerOutput Step(std::int64_t now_us);

 private:
  void OnHeartbeat(NmtState state, std::int64_t now_us);
  void OnAnswer(const SdoMessage& answer, std::int64_t now_us);
  void AskNext(std::int64_t now_us);
  void Down();

  std::uint8_t node_;
  std::vector<ObjectAddress> wanted_;
  std::map<ObjectAddress, std::uint32_t> read_;
  bool up_ = false;
  bool alive_ = false;  // operational heartbeats arrive
  std::int64_t last_heartbeat_us_ = 0;
  std::int64_t asked_us_ = 0;
  PeerOutput output_;  // being collected for the caller
};

}  // namespace forgescan::canopen
