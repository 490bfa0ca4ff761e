#include "drivers/canopen/canopen_peer.h"

#include <utility>

namespace forgescan::canopen {
namespace {

constexpr std::int64_t kSdoTimeout_us = 100'000;  // then the same object is asked for again

}  // namespace

PeerOutput CanopenPeer::OnFrame(const CanFrame& frame, std::int64_t now_us) {
  if (const auto state = ParseHeartbeat(frame, node_)) {
    OnHeartbeat(*state, now_us);
  } else if (const auto emergency = ParseEmergency(frame, node_)) {
    output_.events.emplace_back(*emergency);
  } else if (const auto answer = ParseSdoAnswer(frame, node_)) {
    OnAnswer(*answer, now_us);
  }
  return std::exchange(output_, {});
}

PeerOutput CanopenPeer::Step(std::int64_t now_us) {
  if (alive_ && now_us - last_heartbeat_us_ > kHeartbeatTimeout_us) {
    Down();
  }
  if (alive_ && !up_ && now_us - asked_us_ > kSdoTimeout_us) {
    AskNext(now_us);
  }
  return std::exchange(output_, {});
}

void CanopenPeer::OnHeartbeat(NmtState state, std::int64_t now_us) {
  last_heartbeat_us_ = now_us;
  if (state != NmtState::kOperational) {
    Down();
    if (state != NmtState::kBoot) {  // after its boot message a node is not yet ready for commands
      output_.frames.push_back(NmtFrame(NmtCommand::kStart, node_));
    }
    return;
  }
  if (!alive_) {
    alive_ = true;
    read_.clear();
    AskNext(now_us);
  }
}

void CanopenPeer::OnAnswer(const SdoMessage& answer, std::int64_t now_us) {
  if (!alive_ || up_ || answer.kind != SdoMessage::Kind::kReadAnswer) {
    return;
  }
  read_[answer.object] = answer.value;
  AskNext(now_us);
}

void CanopenPeer::AskNext(std::int64_t now_us) {
  for (const ObjectAddress& address : wanted_) {
    if (!read_.contains(address)) {
      asked_us_ = now_us;
      output_.frames.push_back(
          SdoFrame(kSdoRequestBase + node_, {.kind = SdoMessage::Kind::kRead, .object = address}));
      return;
    }
  }
  up_ = true;
  output_.events.emplace_back(LinkChange{true});
}

void CanopenPeer::Down() {
  alive_ = false;
  if (up_) {
    up_ = false;
    output_.events.emplace_back(LinkChange{false});
  }
}

}  // namespace forgescan::canopen
