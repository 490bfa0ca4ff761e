#include "tools/forgescan/station/process_usage.h"

#include <fstream>
#include <sstream>
#include <string>

#include "tools/forgescan/station/process_id.h"

namespace forgescan {
namespace {

constexpr std::int64_t kShortestUs = 200'000;  // the kernel counts in steps of 10 ms

struct Memory {
  std::int64_t resident_kib = 0, peak_kib = 0;
};

// Nothing for a process that has ended, waited for or not: it has no memory any more.
std::optional<Memory> MemoryOf(pid_t pid) {
  std::ifstream stream("/proc/" + std::to_string(pid) + "/status");
  Memory memory;
  for (std::string line; std::getline(stream, line);) {
    std::istringstream words(line);
    std::string key;
    words >> key;
    if (key == "VmHWM:") {
      words >> memory.peak_kib;
    } else if (key == "VmRSS:") {
      words >> memory.resident_kib;
      return words ? std::optional(memory) : std::nullopt;  // the peak stands above it
    }
  }
  return std::nullopt;
}

double Megabytes(std::int64_t kib) { return static_cast<double>(kib) * 1024e-6; }

}  // namespace

std::optional<Usage> ProcessUsage::Of(pid_t pid, std::int64_t now_us) {
  const auto stat = pid > 0 ? ReadProcessStat(pid) : std::nullopt;
  const auto memory = stat ? MemoryOf(pid) : std::nullopt;
  if (!memory) {
    samples_.erase(pid);
    return std::nullopt;
  }
  const auto [found, first] = samples_.try_emplace(pid, Sample{now_us, stat->cpu_us, std::nullopt});
  Sample& sample = found->second;
  const std::int64_t passed_us = now_us - sample.at_us;
  if (!first && passed_us >= kShortestUs) {
    sample = {now_us, stat->cpu_us,
              100.0 * static_cast<double>(stat->cpu_us - sample.cpu_us) / static_cast<double>(passed_us)};
  }
  return Usage{sample.percent, Megabytes(memory->resident_kib), Megabytes(memory->peak_kib)};
}

}  // namespace forgescan
