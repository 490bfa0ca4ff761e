// Every channel of channels.h as data: for whoever handles all of them, whatever their type.
#pragma once

#include <cstdint>
#include <vector>

namespace forgescan {

enum class ChannelKind { kStream, kState, kLog };

struct ChannelInfo {
  const char* name;
  const char* type;          // e.g. frame_t
  std::int64_t fingerprint;  // LCM's, the first 8 bytes of every message
  ChannelKind kind;
};

// In the order of channels.h.
std::vector<ChannelInfo> AllChannels();

}  // namespace forgescan
