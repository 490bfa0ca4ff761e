// Which channels carry state: sent again and again, without sequence or checksum.
#pragma once

#include <string_view>

#include "services/common/bus/channels.h"

namespace forgescan {

constexpr bool IsStateChannel(std::string_view channel) {
  return channel == kPathState.name || channel == kCoolingState.name || channel == kServiceState.name ||
         channel == kRecorderState.name;
}

}  // namespace forgescan
