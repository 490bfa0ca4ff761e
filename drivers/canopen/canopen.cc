#include "drivers/canopen/canopen.h"

namespace forgescan::canopen {
namespace {

bool IsData(const CanFrame& frame, std::uint32_t id, std::uint8_t length) {
  return frame.id == id && frame.length == length && !frame.extended && !frame.rtr && !frame.error;
}

void Put32(CanFrame& frame, std::size_t at, std::uint32_t value) {
  for (std::size_t i = 0; i < 4; ++i) {
    frame.data[at + i] = static_cast<std::uint8_t>(value >> (8 * i));
  }
}

std::uint32_t Get32(const CanFrame& frame, std::size_t at) {
  std::uint32_t value = 0;
  for (std::size_t i = 0; i < 4; ++i) {
    value |= std::uint32_t{frame.data[at + i]} << (8 * i);
  }
  return value;
}

std::uint16_t Get16(const CanFrame& frame, std::size_t at) {
  return static_cast<std::uint16_t>(frame.data[at] | frame.data[at + 1] << 8);
}

// Command specifiers of expedited transfers with the size given (bits: 3 command, 2 unused bytes, e, s).
std::uint8_t SpecifierOf(const SdoMessage& message) {
  const int unused = (4 - message.bytes) << 2;
  switch (message.kind) {
    case SdoMessage::Kind::kRead:
      return 0x40;
    case SdoMessage::Kind::kReadAnswer:
      return static_cast<std::uint8_t>(0x43 | unused);
    case SdoMessage::Kind::kWrite:
      return static_cast<std::uint8_t>(0x23 | unused);
    case SdoMessage::Kind::kWriteAnswer:
      return 0x60;
    case SdoMessage::Kind::kAbort:
      break;
  }
  return 0x80;
}

SdoMessage Unpack(const CanFrame& frame, SdoMessage::Kind kind) {
  SdoMessage message;
  message.kind = kind;
  message.object = {Get16(frame, 1), frame.data[3]};
  message.value = Get32(frame, 4);
  const bool sized = kind == SdoMessage::Kind::kReadAnswer || kind == SdoMessage::Kind::kWrite;
  message.bytes = static_cast<std::uint8_t>(sized ? 4 - (frame.data[0] >> 2 & 3) : 4);
  if (message.bytes < 4) {
    message.value &= (std::uint32_t{1} << (8 * message.bytes)) - 1;
  }
  return message;
}

}  // namespace

CanFrame NmtFrame(NmtCommand command, std::uint8_t node) {
  return {.id = kNmtId, .length = 2, .data = {static_cast<std::uint8_t>(command), node}};
}

CanFrame HeartbeatFrame(std::uint8_t node, NmtState state) {
  return {.id = kHeartbeatBase + node, .length = 1, .data = {static_cast<std::uint8_t>(state)}};
}

CanFrame EmergencyFrame(std::uint8_t node, const Emergency& emergency) {
  CanFrame frame{.id = kEmergencyBase + node, .length = 8};
  frame.data[0] = static_cast<std::uint8_t>(emergency.code);
  frame.data[1] = static_cast<std::uint8_t>(emergency.code >> 8);
  frame.data[2] = emergency.error_register;
  Put32(frame, 3, emergency.detail);
  return frame;
}

std::optional<NmtCommand> ParseNmt(const CanFrame& frame, std::uint8_t node) {
  if (!IsData(frame, kNmtId, 2) || (frame.data[1] != 0 && frame.data[1] != node)) {
    return std::nullopt;
  }
  for (const NmtCommand known : {NmtCommand::kStart, NmtCommand::kStop, NmtCommand::kPreOperational,
                                 NmtCommand::kResetNode, NmtCommand::kResetCommunication}) {
    if (frame.data[0] == static_cast<std::uint8_t>(known)) {
      return known;
    }
  }
  return std::nullopt;
}

std::optional<NmtState> ParseHeartbeat(const CanFrame& frame, std::uint8_t node) {
  if (!IsData(frame, kHeartbeatBase + node, 1)) {
    return std::nullopt;
  }
  for (const NmtState known :
       {NmtState::kBoot, NmtState::kStopped, NmtState::kOperational, NmtState::kPreOperational}) {
    if (frame.data[0] == static_cast<std::uint8_t>(known)) {
      return known;
    }
  }
  return std::nullopt;
}

std::optional<Emergency> ParseEmergency(const CanFrame& frame, std::uint8_t node) {
  if (!IsData(frame, kEmergencyBase + node, 8)) {
    return std::nullopt;
  }
  return Emergency{Get16(frame, 0), frame.data[2], Get32(frame, 3)};
}

CanFrame SdoFrame(std::uint32_t id, const SdoMessage& message) {
  CanFrame frame{.id = id, .length = 8};
  frame.data[0] = SpecifierOf(message);
  frame.data[1] = static_cast<std::uint8_t>(message.object.index);
  frame.data[2] = static_cast<std::uint8_t>(message.object.index >> 8);
  frame.data[3] = message.object.subindex;
  Put32(frame, 4, message.value);
  return frame;
}

std::optional<SdoMessage> ParseSdoRequest(const CanFrame& frame, std::uint8_t node) {
  if (!IsData(frame, kSdoRequestBase + node, 8)) {
    return std::nullopt;
  }
  if (frame.data[0] == 0x40) {
    return Unpack(frame, SdoMessage::Kind::kRead);
  }
  const bool expedited_write = (frame.data[0] & 0xF3) == 0x23;
  return expedited_write ? std::optional(Unpack(frame, SdoMessage::Kind::kWrite)) : std::nullopt;
}

std::optional<SdoMessage> ParseSdoAnswer(const CanFrame& frame, std::uint8_t node) {
  if (!IsData(frame, kSdoAnswerBase + node, 8)) {
    return std::nullopt;
  }
  if ((frame.data[0] & 0xF3) == 0x43) {
    return Unpack(frame, SdoMessage::Kind::kReadAnswer);
  }
  if (frame.data[0] == 0x60) {
    return Unpack(frame, SdoMessage::Kind::kWriteAnswer);
  }
  return frame.data[0] == 0x80 ? std::optional(Unpack(frame, SdoMessage::Kind::kAbort)) : std::nullopt;
}

}  // namespace forgescan::canopen
