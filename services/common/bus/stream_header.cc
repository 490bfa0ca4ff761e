#include "services/common/bus/stream_header.h"

#include <libdeflate.h>

#include <algorithm>
#include <array>

#include "services/common/bus/big_endian.h"

namespace forgescan {
namespace {

constexpr std::size_t kUtimeAt = 8, kSessionAt = 16, kSequenceAt = 24, kCrcAt = 32;

template <typename Integer>
void Put(Bytes& message, std::size_t at, Integer value) {
  for (std::size_t i = 0; i < sizeof value; ++i) {
    message[at + i] = static_cast<std::uint8_t>(value >> (8 * (sizeof value - 1 - i)));
  }
}

std::uint32_t CrcWithoutItself(ByteView message) {
  constexpr std::array<std::uint8_t, 4> kZero{};
  std::uint32_t crc = libdeflate_crc32(0, message.data(), kCrcAt);
  crc = libdeflate_crc32(crc, kZero.data(), kZero.size());
  const ByteView rest = message.subspan(kStreamHeaderBytes);
  return rest.empty() ? crc : libdeflate_crc32(crc, rest.data(), rest.size());
}

Status CheckLength(ByteView message) {
  if (message.size() < kStreamHeaderBytes) {
    return Fail(ErrorCode::kFormat, "{} bytes are too short for a stream message", message.size());
  }
  return {};
}

}  // namespace

Status StampStreamHeader(Bytes& message, const StreamHeader& header) {
  if (message.size() < kStreamHeaderBytes) {
    return Fail(ErrorCode::kInvalidArgument, "a stream message has at least {} bytes, not {}",
                kStreamHeaderBytes, message.size());
  }
  Put(message, kSessionAt, header.session);
  Put(message, kSequenceAt, header.sequence);
  Put(message, kCrcAt, CrcWithoutItself(message));
  return {};
}

Result<std::int64_t> StreamUtime(ByteView message) {
  RETURN_IF_ERROR(CheckLength(message));
  return BigEndianAt<std::int64_t>(message, kUtimeAt);
}

Result<StreamHeader> ReadStreamHeader(ByteView message) {
  RETURN_IF_ERROR(CheckLength(message));
  return StreamHeader{BigEndianAt<std::int64_t>(message, kSessionAt),
                      BigEndianAt<std::int64_t>(message, kSequenceAt)};
}

Result<StreamHeader> CheckStreamHeader(ByteView message) {
  RETURN_IF_ERROR(CheckLength(message));
  if (BigEndianAt<std::uint32_t>(message, kCrcAt) != CrcWithoutItself(message)) {
    return Fail(ErrorCode::kFormat, "a message of {} bytes has a wrong CRC-32", message.size());
  }
  return ReadStreamHeader(message);
}

}  // namespace forgescan
