#include "drivers/can/can_bus.h"

#include <algorithm>

namespace forgescan {

bool SameOnWire(const CanFrame& a, const CanFrame& b) {
  return a.id == b.id && a.extended == b.extended && a.rtr == b.rtr && a.error == b.error &&
         a.length == b.length && a.data == b.data;
}

Status CheckSendable(const CanFrame& frame) {
  const std::uint32_t limit = frame.extended ? kMaxExtendedCanId : kMaxStandardCanId;
  if (frame.id > limit) {
    return Fail(ErrorCode::kInvalidArgument, "CAN identifier {:#x} is above {:#x}", frame.id, limit);
  }
  if (frame.length > 8) {
    return Fail(ErrorCode::kInvalidArgument, "CAN frame {:#x} has length {}, the limit is 8", frame.id,
                frame.length);
  }
  if (frame.error) {
    return Fail(ErrorCode::kInvalidArgument,
                "CAN frame {:#x} is an error frame, which only a controller makes", frame.id);
  }
  return {};
}

bool CanFilter::Passes(const CanFrame& frame) const {
  return frame.extended == extended && (frame.id & mask) == (id & mask);
}

Status CanBus::SetFilters(std::vector<CanFilter> filters) {
  filters_ = std::move(filters);
  return {};
}

void CanBus::Deliver(const CanFrame& frame) {
  const auto passes = [&](const CanFilter& filter) { return filter.Passes(frame); };
  if (!frame.error && !filters_.empty() && std::none_of(filters_.begin(), filters_.end(), passes)) {
    ++counters_.filtered;
    return;
  }
  ++(frame.error ? counters_.error_frames : counters_.received);
  for (const Handler& handler : handlers_) {
    handler(frame);
  }
}

}  // namespace forgescan
