#include "services/common/log/log_header.h"

#include <algorithm>

#include "services/common/bus/big_endian.h"

namespace forgescan {
namespace {

constexpr std::size_t kNumberAt = 4, kUtimeAt = 12, kChannelBytesAt = 20, kMessageBytesAt = 24;

bool IsPrintable(std::uint8_t byte) { return byte >= 0x20 && byte < 0x7F; }

bool IsUtf8(ByteView text) {
  while (!text.empty()) {
    const std::size_t bytes = PrintableBytes(text);
    if (bytes == 0) {
      return false;
    }
    text = text.subspan(bytes);
  }
  return true;
}

}  // namespace

// The Unicode Standard, table 3-7: well-formed byte sequences.
std::size_t PrintableBytes(ByteView text) {
  const std::uint8_t first = text[0];
  if (first < 0x80) {
    return IsPrintable(first) ? 1 : 0;
  }
  const std::size_t bytes = first >= 0xC2 && first <= 0xDF   ? 2
                            : first >= 0xE0 && first <= 0xEF ? 3
                            : first >= 0xF0 && first <= 0xF4 ? 4
                                                             : 0;
  if (bytes == 0 || text.size() < bytes) {
    return 0;
  }
  std::uint8_t least = 0x80, most = 0xBF;  // of the second byte
  switch (first) {
    case 0xC2:
      least = 0xA0;  // below are control characters
      break;
    case 0xE0:
      least = 0xA0;
      break;
    case 0xED:
      most = 0x9F;
      break;
    case 0xF0:
      least = 0x90;
      break;
    case 0xF4:
      most = 0x8F;
      break;
    default:
      break;
  }
  const bool is_second = text[1] >= least && text[1] <= most;
  const ByteView others = text.first(bytes).subspan(2);
  return is_second && std::all_of(others.begin(), others.end(), [](std::uint8_t b) { return b >> 6 == 2; })
             ? bytes
             : 0;
}

bool IsAscii(const std::string& name) {
  return std::all_of(name.begin(), name.end(), [](char c) { return static_cast<std::uint8_t>(c) < 0x80; });
}

bool HasLogSyncWord(ByteView bytes) {
  return bytes.size() >= sizeof kLogSyncWord && BigEndianAt<std::uint32_t>(bytes, 0) == kLogSyncWord;
}

std::optional<LogHeader> ParseLogHeader(ByteView bytes, std::uint64_t offset, LogNames names) {
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
  const bool is_name =
      names == LogNames::kUtf8 ? IsUtf8(name) : std::all_of(name.begin(), name.end(), IsPrintable);
  if (!is_name) {
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
