// The device's side of CANopen: network state, heartbeat, object dictionary behind expedited SDO.
#pragma once

#include <map>
#include <vector>

#include "drivers/canopen/canopen.h"

namespace forgescan::canopen {

class CanopenNode {
 public:
  explicit CanopenNode(std::uint8_t node) : node_(node) {}

  NmtState state() const { return state_; }
  bool operational() const { return state_ == NmtState::kOperational; }

  void SetObject(ObjectAddress address, const ObjectEntry& entry) { objects_[address] = entry; }
  std::optional<std::uint32_t> Object(ObjectAddress address) const;

  // Answers to a frame from the bus; a reset or restart makes the next Step begin with the boot message.
  std::vector<CanFrame> OnFrame(const CanFrame& frame);

  // The heartbeats due until now. The first call sends the boot message and enters pre-operational.
  std::vector<CanFrame> Step(std::int64_t now_us);

 private:
  CanFrame AnswerSdo(const SdoMessage& request);

  std::uint8_t node_;
  NmtState state_ = NmtState::kBoot;
  std::int64_t next_heartbeat_us_ = 0;
  std::map<ObjectAddress, ObjectEntry> objects_;
};

}  // namespace forgescan::canopen
