// The header of an event in an LCM log, and how far its numbers can be believed.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "services/common/bus/bus.h"
#include "services/common/log/log_format.h"

namespace forgescan {

struct LogHeader {
  std::uint64_t offset = 0;  // in the file
  std::int64_t number = 0;
  std::int64_t utime = 0;
  std::uint32_t bytes = 0;  // of the message
  std::string channel;

  std::uint64_t message_offset() const { return offset + kLogHeaderBytes + channel.size(); }
  std::uint64_t end() const { return message_offset() + bytes; }
};

// What must be there of an event to judge its header.
inline constexpr std::size_t kMaxLogHeadBytes = kLogHeaderBytes + kMaxLogChannelBytes;

bool HasLogSyncWord(ByteView bytes);
// What a channel's name may consist of. Every name is UTF-8 without control characters; pure ASCII says more
// for a header that may be none.
enum class LogNames { kAscii, kUtf8 };
// Takes the numbers and the channel's name from bytes that begin at `offset` of the file. Nothing if the
// bytes are too few, a length is out of its range (log_format.h) or the name is no such name. Does not look
// at the sync word, and does not know where the file ends.
std::optional<LogHeader> ParseLogHeader(ByteView bytes, std::uint64_t offset, LogNames names);
bool IsAscii(const std::string& name);
// Bytes of the character in UTF-8 that the text begins with; 0 = none, or a control character. text: not
// empty.
std::size_t PrintableBytes(ByteView text);

}  // namespace forgescan
