// GVCP, the control protocol of GigE Vision: the codec of its UDP packets, nothing else.
//
// Source: GigE Vision 1.2, control protocol. A command is 8 bytes {0x42, flags, command, payload length, id}
// and a payload; an acknowledge is 8 bytes {status, acknowledge, payload length, id} and a payload; all
// fields big-endian.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "services/common/result.h"

namespace forgescan::gige {

inline constexpr std::uint16_t kGvcpPort = 3956;

enum class GvcpOperation : std::uint16_t {  // the acknowledge of an operation is its number + 1
  kDiscovery = 0x0002,
  kPacketResend = 0x0040,  // has no acknowledge: the packets are the answer
  kReadRegister = 0x0080,
  kWriteRegister = 0x0082,
  kReadMemory = 0x0084,
  kWriteMemory = 0x0086,
};

enum class GvcpStatus : std::uint16_t {
  kSuccess = 0x0000,
  kNotImplemented = 0x8001,
  kInvalidParameter = 0x8002,
  kInvalidAddress = 0x8003,
  kWriteProtect = 0x8004,
  kBadAlignment = 0x8005,
  kAccessDenied = 0x8006,
  kBusy = 0x8007,
};

struct GvcpCommand {
  GvcpOperation operation{};
  std::uint16_t id = 0;
  bool wants_acknowledge = false;
  std::vector<std::uint8_t> payload;
};

struct ResendRequest {
  std::uint16_t block_id = 0;
  std::uint32_t first_packet = 0;
  std::uint32_t last_packet = 0;  // inclusive
};

// Errors: kFormat if the bytes are no GVCP command or their length contradicts the header.
Result<GvcpCommand> ParseGvcpCommand(std::span<const std::uint8_t> datagram);
std::vector<std::uint8_t> MakeGvcpAcknowledge(const GvcpCommand& command, GvcpStatus status,
                                              std::span<const std::uint8_t> payload);
// Errors: kFormat if the payload is short or last_packet < first_packet.
Result<ResendRequest> ParseResendRequest(const GvcpCommand& command);

}  // namespace forgescan::gige
