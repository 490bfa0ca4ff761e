#include "services/common/log/channel_totals.h"

#include <libdeflate.h>

namespace forgescan {

void ChannelTotals::Add(std::string_view channel, ByteView message) {
  auto found = totals_.find(channel);
  if (found == totals_.end()) {
    found = totals_.emplace(std::string(channel), Total{}).first;
  }
  Total& total = found->second;
  ++total.events;
  total.bytes += static_cast<std::int64_t>(message.size());
  if (!message.empty()) {  // libdeflate takes a null pointer for the start of a new CRC
    total.crc32 = libdeflate_crc32(total.crc32, message.data(), message.size());
  }
}

std::vector<fsmsg::channel_total_t> ChannelTotals::Totals() const {
  std::vector<fsmsg::channel_total_t> totals;
  for (const auto& [channel, total] : totals_) {
    fsmsg::channel_total_t entry{};
    entry.channel = channel;
    entry.events = total.events;
    entry.bytes = total.bytes;
    entry.crc32 = static_cast<std::int32_t>(total.crc32);
    totals.push_back(entry);
  }
  return totals;
}

}  // namespace forgescan
