// CLOCK_MONOTONIC in nanoseconds: the simulator's real-time pacing, and the time base of Edge().
#pragma once

#include <chrono>
#include <cstdint>

namespace forgescan {

inline std::int64_t MonoNowNs() {
  return std::chrono::duration_cast<std::chrono::nanoseconds>(
             std::chrono::steady_clock::now().time_since_epoch())
      .count();
}

inline std::chrono::steady_clock::time_point MonoTimePoint(std::int64_t t_mono_ns) {
  return std::chrono::steady_clock::time_point(std::chrono::nanoseconds(t_mono_ns));
}

}  // namespace forgescan
