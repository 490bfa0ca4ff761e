// Every channel of channels.h as data: for whoever handles all of them, whatever their type.
#pragma once

#include <cstdint>
#include <string_view>
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
// False for a channel that is not in the list.
bool IsStateChannel(std::string_view channel);

}  // namespace forgescan
