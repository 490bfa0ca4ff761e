#include "tools/virtual_station/gige/link.h"

#include <algorithm>
#include <cmath>

namespace forgescan {

std::int64_t WireTimeNs(std::size_t wire_bytes, double rate_mbit_s) {
  if (!(rate_mbit_s > 0)) {
    return 0;
  }
  return std::llround(static_cast<double>(wire_bytes) * 8000.0 / rate_mbit_s);  // 8 bit, 1000 ns per Mbit/s
}

bool Link::Admit(std::int64_t t_mono_ns, std::size_t wire_bytes) {
  const std::lock_guard lock(mutex_);
  const std::int64_t waiting_ns = std::max<std::int64_t>(free_at_ns_ - t_mono_ns, 0);
  if (waiting_ns + WireTimeNs(wire_bytes, options_.rate_mbit_s) >
      WireTimeNs(options_.buffer_bytes, options_.rate_mbit_s)) {
    ++dropped_;
    return false;
  }
  free_at_ns_ = std::max(free_at_ns_, t_mono_ns) + WireTimeNs(wire_bytes, options_.rate_mbit_s);
  ++admitted_;
  return true;
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
