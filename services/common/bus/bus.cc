#include "services/common/bus/bus.h"

namespace forgescan {

Status CheckPublish(std::string_view channel, ByteView message) {
  if (channel.empty() || channel.size() > 63) {
    return Fail(ErrorCode::kInvalidArgument, "channel name \"{}\" has {} characters; 1 to 63 are allowed",
                channel, channel.size());
  }
  if (message.size() > kMaxMessageBytes) {
    return Fail(ErrorCode::kInvalidArgument, "{}: a message of {} bytes is over the limit of {}", channel,
                message.size(), kMaxMessageBytes);
  }
  return {};
}

}  // namespace forgescan
