// Processor time and memory of processes, from /proc.
#pragma once

#include <sys/types.h>

#include <cstdint>
#include <map>
#include <optional>

namespace forgescan {

struct Usage {
  std::optional<double> cpu_percent;  // of one core, since the call before; nothing at the first one
  double memory_mb = 0;               // resident, 10^6 bytes
  double peak_memory_mb = 0;          // the most that was ever resident
};

class ProcessUsage {
 public:
  // Nothing if there is no such process (any more). now_us: any steady clock.
  std::optional<Usage> Of(pid_t pid, std::int64_t now_us);

 private:
  struct Sample {
    std::int64_t at_us = 0;
    std::int64_t cpu_us = 0;
    std::optional<double> percent;
  };
  std::map<pid_t, Sample> samples_;
};

}  // namespace forgescan
