#include "tools/virtual_station/gige/link.h"

#include <algorithm>
#include <cmath>
#include <iterator>

namespace forgescan {
namespace {

constexpr std::int64_t kMemory_ns = 1'000'000'000;  // a thread later than this finds an idle port

}  // namespace

std::int64_t WireTimeNs(std::size_t wire_bytes, double rate_mbit_s) {
  if (!(rate_mbit_s > 0)) {
    return 0;
  }
  return std::llround(static_cast<double>(wire_bytes) * 8000.0 / rate_mbit_s);  // 8 bit, 1000 ns per Mbit/s
}

bool Link::Admit(std::int64_t t_mono_ns, std::size_t wire_bytes) {
  const std::lock_guard lock(mutex_);
  const std::int64_t packet_ns = WireTimeNs(wire_bytes, options_.rate_mbit_s);
  const std::int64_t buffer_ns = WireTimeNs(options_.buffer_bytes, options_.rate_mbit_s);
  // The first pause of the port, from the packet's arrival on, that is long enough to send it in.
  std::int64_t begin_ns = t_mono_ns;
  auto next = busy_ns_.upper_bound(t_mono_ns);
  if (next != busy_ns_.begin()) {
    begin_ns = std::max(begin_ns, std::prev(next)->second);
  }
  for (; next != busy_ns_.end() && next->first < begin_ns + packet_ns; ++next) {
    begin_ns = next->second;
  }
  if (begin_ns - t_mono_ns + packet_ns > buffer_ns) {
    ++dropped_;
    return false;
  }
  Occupy(begin_ns, begin_ns + packet_ns);
  ++admitted_;
  return true;
}

// Precondition: the port is free from begin_ns to end_ns.
void Link::Occupy(std::int64_t begin_ns, std::int64_t end_ns) {
  auto next = busy_ns_.lower_bound(end_ns);
  if (next != busy_ns_.end() && next->first == end_ns) {
    end_ns = next->second;
    next = busy_ns_.erase(next);
  }
  if (next != busy_ns_.begin() && std::prev(next)->second == begin_ns) {
    std::prev(next)->second = end_ns;
  } else {
    busy_ns_.emplace_hint(next, begin_ns, end_ns);
  }
  while (busy_ns_.begin()->second < busy_ns_.rbegin()->second - kMemory_ns) {
    busy_ns_.erase(busy_ns_.begin());
  }
}

std::uint64_t Link::admitted() const {
  const std::lock_guard lock(mutex_);
  return admitted_;
}

std::uint64_t Link::dropped() const {
  const std::lock_guard lock(mutex_);
  return dropped_;
}

}  // namespace forgescan
