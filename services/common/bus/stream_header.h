// The fields every stream message begins with, at fixed places of its encoded bytes, so that a stream can
// stamp and check any type without knowing it:
//   bytes 0..7 LCM fingerprint, 8..15 utime, 16..23 session, 24..31 sequence, 32..35 crc32; all big-endian.
// crc32 is the CRC-32 (IEEE 802.3) of the whole encoded message with bytes 32..35 zero.
#pragma once

#include <cstdint>

#include "services/common/bus/bus.h"

namespace forgescan {

struct StreamHeader {
  std::int64_t session = 0;   // us since 1970 UTC at which the sender started
  std::int64_t sequence = 0;  // 1, 2, 3, ...
};

inline constexpr std::size_t kStreamHeaderBytes = 36;

// Errors: kInvalidArgument (the message is shorter than a header).
Status StampStreamHeader(Bytes& message, const StreamHeader& header);
// When the message's event was, us since 1970 UTC. Errors: kFormat (shorter than a header).
Result<std::int64_t> StreamUtime(ByteView message);
// The header as it stands there; for a message whose CRC was checked before. Errors: kFormat (shorter than a
// header).
Result<StreamHeader> ReadStreamHeader(ByteView message);
// Errors: kFormat (too short, or the CRC does not match its bytes).
Result<StreamHeader> CheckStreamHeader(ByteView message);

}  // namespace forgescan
