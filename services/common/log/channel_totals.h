// Counts what a recording holds of every channel, for its closing event and for checking it.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "fsmsg/channel_total_t.hpp"
#include "services/common/bus/bus.h"

namespace forgescan {

class ChannelTotals {
 public:
  void Add(std::string_view channel, ByteView message);
  // By name.
  std::vector<fsmsg::channel_total_t> Totals() const;

 private:
  struct Total {
    std::int64_t events = 0;
    std::int64_t bytes = 0;
    std::uint32_t crc32 = 0;
  };
  std::map<std::string, Total, std::less<>> totals_;
};

}  // namespace forgescan
