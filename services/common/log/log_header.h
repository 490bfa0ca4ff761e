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
// Takes the numbers and the channel's name from bytes that begin at `offset` of the file. Nothing if the
// bytes are too few, a length is out of its range (log_format.h) or the name is not printable. Does not look
// at the sync word, and does not know where the file ends.
std::optional<LogHeader> ParseLogHeader(ByteView bytes, std::uint64_t offset);

}  // namespace forgescan
