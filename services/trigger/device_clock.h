// Puts the microcontroller's 32-bit clock, which wraps and drifts, on the station's time.
#pragma once

#include <cstdint>
#include <deque>
#include <optional>

namespace forgescan {

class DeviceClock {
 public:
  // A status that carried the device's time when it was sent, and when it arrived. Frames are only ever late,
  // so the smallest difference of the last 64 is the offset: at 10 Hz and 50 ppm of drift the error stays
  // below 0.4 ms.
  void OnStatus(std::uint32_t device_time_us, std::int64_t arrival_utime);
  // A status whose time goes back, or runs ahead of its arrival: the device was started again since the last
  // one. To be asked before OnStatus().
  bool HasRestarted(std::uint32_t device_time_us, std::int64_t arrival_utime) const;
  void Reset() { *this = DeviceClock(); }

  // 64-bit device time nearest to the last status; nothing before the first status.
  std::optional<std::int64_t> Unwrap(std::uint32_t device_time_us) const;
  std::optional<std::int64_t> ToStation(std::int64_t unwrapped_us) const;

 private:
  bool started_ = false;
  std::int64_t last_unwrapped_us_ = 0;
  std::int64_t last_arrival_us_ = 0;
  std::deque<std::int64_t> offsets_us_;
};

}  // namespace forgescan
