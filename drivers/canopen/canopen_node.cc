#include "drivers/canopen/canopen_node.h"

namespace forgescan::canopen {

std::optional<std::uint32_t> CanopenNode::Object(ObjectAddress address) const {
  const auto found = objects_.find(address);
  return found == objects_.end() ? std::nullopt : std::optional(found->second.value);
}

CanFrame CanopenNode::AnswerSdo(const SdoMessage& request) {
  SdoMessage answer{.kind = SdoMessage::Kind::kAbort, .object = request.object};
  const auto found = objects_.find(request.object);
  if (found == objects_.end()) {
    answer.value = kAbortNoObject;
  } else if (request.kind == SdoMessage::Kind::kRead) {
    answer.kind = SdoMessage::Kind::kReadAnswer;
    answer.value = found->second.value;
    answer.bytes = found->second.bytes;
  } else if (!found->second.writable) {
    answer.value = kAbortReadOnly;
  } else if (request.bytes != found->second.bytes) {
    answer.value = kAbortWrongLength;
  } else {
    found->second.value = request.value;
    answer.kind = SdoMessage::Kind::kWriteAnswer;
  }
  return SdoFrame(kSdoAnswerBase + node_, answer);
}

std::vector<CanFrame> CanopenNode::OnFrame(const CanFrame& frame) {
  if (const auto command = ParseNmt(frame, node_)) {
    switch (*command) {
      case NmtCommand::kStart:
        state_ = NmtState::kOperational;
        break;
      case NmtCommand::kStop:
        state_ = NmtState::kStopped;
        break;
      case NmtCommand::kPreOperational:
        state_ = NmtState::kPreOperational;
        break;
      case NmtCommand::kResetNode:
      case NmtCommand::kResetCommunication:
        state_ = NmtState::kBoot;
        break;
    }
    return {};
  }
  if (frame.id != kSdoRequestBase + node_ || state_ == NmtState::kStopped) {
    return {};
  }
  if (const auto request = ParseSdoRequest(frame, node_)) {
    return {AnswerSdo(*request)};
  }
  const ObjectAddress address{static_cast<std::uint16_t>(frame.data[1] | frame.data[2] << 8), frame.data[3]};
  return {SdoFrame(kSdoAnswerBase + node_,
                   {.kind = SdoMessage::Kind::kAbort, .object = address, .value = kAbortUnknownCommand})};
}

std::vector<CanFrame> CanopenNode::Step(std::int64_t now_us) {
  if (state_ == NmtState::kBoot) {
    state_ = NmtState::kPreOperational;
    next_heartbeat_us_ = now_us + kHeartbeatPeriod_us;
    return {HeartbeatFrame(node_, NmtState::kBoot)};
  }
  if (now_us < next_heartbeat_us_) {
    return {};
  }
  next_heartbeat_us_ = now_us + kHeartbeatPeriod_us;
  return {HeartbeatFrame(node_, state_)};
}

}  // namespace forgescan::canopen
