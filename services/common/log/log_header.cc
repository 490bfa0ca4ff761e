#include "services/common/log/log_header.h"

#include <algorithm>

#include "services/common/bus/big_endian.h"

namespace forgescan {
namespace {

constexpr std::size_t kNumberAt = 4, kUtimeAt = 12, kChannelBytesAt = 20, kMessageBytesAt = 24;

bool IsPrintable(std::uint8_t byte) { return byte >= 0x20 && byte < 0x7F; }

}  // namespace

bool HasLogSyncWord(ByteView bytes) {
  return bytes.size() >= sizeof kLogSyncWord && BigEndianAt<std::uint32_t>(bytes, 0) == kLogSyncWord;
}

std::optional<LogHeader> ParseLogHeader(ByteView bytes, std::uint64_t offset) {
  if (bytes.size() < kLogHeaderBytes) {
    return std::nullopt;
  }
  // A negative length becomes one that is far too large.
  const std::size_t name_bytes = BigEndianAt<std::uint32_t>(bytes, kChannelBytesAt),
                    message_bytes = BigEndianAt<std::uint32_t>(bytes, kMessageBytesAt);
  if (name_bytes < 1 || name_bytes > kMaxLogChannelBytes || message_bytes > kMaxLogMessageBytes ||
      bytes.size() < kLogHeaderBytes + name_bytes) {
    return std::nullopt;
  }
  const ByteView name = bytes.subspan(kLogHeaderBytes, name_bytes);
  if (!std::all_of(name.begin(), name.end(), IsPrintable)) {
    return std::nullopt;
  }
  LogHeader header;
  header.offset = offset;
  header.number = BigEndianAt<std::int64_t>(bytes, kNumberAt);
  header.utime = BigEndianAt<std::int64_t>(bytes, kUtimeAt);
  header.bytes = static_cast<std::uint32_t>(message_bytes);
  header.channel.assign(name.begin(), name.end());
  return header;
}

}  // namespace forgescan
