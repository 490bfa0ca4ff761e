// Numbers of LCM's event log format, and the limits within which a header is believed.
#pragma once

#include <cstddef>
#include <cstdint>

namespace forgescan {

inline constexpr std::uint32_t kLogSyncWord = 0xEDA1DA01;
inline constexpr std::size_t kLogHeaderBytes = 28;
inline constexpr std::size_t kMaxLogChannelBytes = 63;  // LCM's limit for a channel's name
// Far above any message of ours (5.5 MB on the bus; a recorded file may be larger), far below what would
// exhaust memory.
inline constexpr std::size_t kMaxLogMessageBytes = 64'000'000;

}  // namespace forgescan
