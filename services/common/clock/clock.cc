#include "services/common/clock/clock.h"

#include <chrono>

namespace forgescan {
namespace {

template <typename AnyClock>
std::int64_t SinceEpochUs() {
  const auto since = AnyClock::now().time_since_epoch();
  return std::chrono::duration_cast<std::chrono::microseconds>(since).count();
}

}  // namespace

RealClock::RealClock()
    : offset_us_(SinceEpochUs<std::chrono::system_clock>() - SinceEpochUs<std::chrono::steady_clock>()) {}

std::int64_t RealClock::NowUs() const { return SinceEpochUs<std::chrono::steady_clock>() + offset_us_; }

}  // namespace forgescan
