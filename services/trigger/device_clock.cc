#include "services/trigger/device_clock.h"

#include <algorithm>

namespace forgescan {
namespace {

constexpr std::size_t kWindow = 64;
constexpr std::int64_t kBack_us = 1'000'000;   // statuses come in order
constexpr std::int64_t kAhead_us = 5'000'000;  // the last one may have come late

}  // namespace

bool DeviceClock::HasRestarted(std::uint32_t device_time_us, std::int64_t arrival_utime) const {
  const auto unwrapped_us = Unwrap(device_time_us);
  if (!unwrapped_us) {
    return false;
  }
  const std::int64_t step_us = *unwrapped_us - last_unwrapped_us_;
  return step_us < -kBack_us || step_us > arrival_utime - last_arrival_us_ + kAhead_us;
}

void DeviceClock::OnStatus(std::uint32_t device_time_us, std::int64_t arrival_utime) {
  const std::int64_t unwrapped_us = Unwrap(device_time_us).value_or(device_time_us);
  started_ = true;
  last_unwrapped_us_ = std::max(last_unwrapped_us_, unwrapped_us);
  last_arrival_us_ = arrival_utime;
  offsets_us_.push_back(arrival_utime - unwrapped_us);
  if (offsets_us_.size() > kWindow) {
    offsets_us_.pop_front();
  }
}

std::optional<std::int64_t> DeviceClock::Unwrap(std::uint32_t device_time_us) const {
  if (!started_) {
    return std::nullopt;
  }
  const auto difference =
      static_cast<std::int32_t>(device_time_us - static_cast<std::uint32_t>(last_unwrapped_us_));
  return last_unwrapped_us_ + difference;
}

std::optional<std::int64_t> DeviceClock::ToStation(std::int64_t unwrapped_us) const {
  if (offsets_us_.empty()) {
    return std::nullopt;
  }
  return unwrapped_us + *std::min_element(offsets_us_.begin(), offsets_us_.end());
}

}  // namespace forgescan
