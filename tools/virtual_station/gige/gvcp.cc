#include "tools/virtual_station/gige/gvcp.h"

#include <algorithm>

#include "tools/virtual_station/gige/bytes.h"

namespace forgescan::gige {
namespace {

constexpr std::size_t kHeader_bytes = 8;
constexpr std::uint8_t kCommandKey = 0x42;
constexpr std::uint8_t kAcknowledgeFlag = 0x01;
constexpr std::size_t kResendPayload_bytes = 12;

}  // namespace

Result<GvcpCommand> ParseGvcpCommand(std::span<const std::uint8_t> datagram) {
  if (datagram.size() < kHeader_bytes || datagram[0] != kCommandKey) {
    return Fail(ErrorCode::kFormat, "GVCP: datagram of {} bytes is not a command", datagram.size());
  }
  const std::size_t length_bytes = Get16(datagram, 4);
  if (datagram.size() < kHeader_bytes + length_bytes) {
    return Fail(ErrorCode::kFormat, "GVCP: datagram of {} bytes announces a payload of {}", datagram.size(),
                length_bytes);
  }
  GvcpCommand command;
  command.operation = static_cast<GvcpOperation>(Get16(datagram, 2));
  command.id = Get16(datagram, 6);
  command.wants_acknowledge = (datagram[1] & kAcknowledgeFlag) != 0;
  const auto payload = datagram.subspan(kHeader_bytes, length_bytes);
  command.payload.assign(payload.begin(), payload.end());
  return command;
}

std::vector<std::uint8_t> MakeGvcpAcknowledge(const GvcpCommand& command, GvcpStatus status,
                                              std::span<const std::uint8_t> payload) {
  std::vector<std::uint8_t> datagram(kHeader_bytes + payload.size());
  Put16(datagram, 0, static_cast<std::uint16_t>(status));
  Put16(datagram, 2, static_cast<std::uint32_t>(command.operation) + 1);
  Put16(datagram, 4, static_cast<std::uint32_t>(payload.size()));
  Put16(datagram, 6, command.id);
  std::copy(payload.begin(), payload.end(), datagram.begin() + kHeader_bytes);
  return datagram;
}

Result<ResendRequest> ParseResendRequest(const GvcpCommand& command) {
  if (command.payload.size() < kResendPayload_bytes) {
    return Fail(ErrorCode::kFormat, "GVCP: resend request of {} bytes, must be at least {}",
                command.payload.size(), kResendPayload_bytes);
  }
  constexpr std::uint32_t kPacketIdMask = 0x00ffffff;
  const ResendRequest request{Get16(command.payload, 2), Get32(command.payload, 4) & kPacketIdMask,
                              Get32(command.payload, 8) & kPacketIdMask};
  if (request.last_packet < request.first_packet) {
    return Fail(ErrorCode::kFormat, "GVCP: resend request for packets {}..{}", request.first_packet,
                request.last_packet);
  }
  return request;
}

}  // namespace forgescan::gige
