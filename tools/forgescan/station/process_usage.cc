#include "tools/forgescan/station/process_usage.h"

#include <unistd.h>

#include <fstream>
#include <string>

#include "tools/forgescan/station/process_id.h"

namespace forgescan {
namespace {

constexpr std::int64_t kShortestUs = 200'000;  // the kernel counts in steps of 10 ms

std::optional<double> ResidentMb(pid_t pid) {
  std::ifstream stream("/proc/" + std::to_string(pid) + "/statm");
  std::int64_t total = 0, resident = 0;
  if (!(stream >> total >> resident)) {
    return std::nullopt;
  }
  return static_cast<double>(resident * sysconf(_SC_PAGESIZE)) * 1e-6;
}

}  // namespace

std::optional<Usage> ProcessUsage::Of(pid_t pid, std::int64_t now_us) {
  const auto stat = pid > 0 ? ReadProcessStat(pid) : std::nullopt;
  const auto memory_mb = stat ? ResidentMb(pid) : std::nullopt;
  if (!memory_mb) {
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
  return Usage{sample.percent, *memory_mb};
}

}  // namespace forgescan
