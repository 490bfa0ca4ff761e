// A process and not just its number, which the kernel gives away again.
#pragma once

#include <sys/types.h>

#include <cstdint>
#include <optional>

namespace forgescan {

// What is used of /proc/PID/stat.
struct ProcessStat {
  char state = '?';                // Z: it has ended, and nobody has asked for its exit code yet
  std::int64_t cpu_us = 0;         // user's and system's time
  std::int64_t started_ticks = 0;  // after the computer was booted, in steps of 10 ms
};

// Nothing if there is no such process.
std::optional<ProcessStat> ReadProcessStat(pid_t pid);

struct ProcessId {
  pid_t pid = 0;  // 0: none
  std::int64_t started_ticks = 0;
  bool operator==(const ProcessId&) const = default;

  // {} if there is no such process.
  static ProcessId Of(pid_t pid);
  // That very process is there and has not ended.
  bool Runs() const;
};

}  // namespace forgescan
