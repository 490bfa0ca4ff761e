#include "tools/forgescan/station/process_usage.h"

#include <unistd.h>

#include <fstream>
#include <sstream>
#include <string>

namespace forgescan {
namespace {

constexpr std::int64_t kShortestUs = 200'000;  // the kernel counts in steps of 10 ms
constexpr int kUserTime = 14;                  // field of /proc/PID/stat, from 1; the system's time follows

// Nothing if it cannot be read. The name in brackets may hold blanks, so fields count from its end.
std::optional<std::int64_t> CpuUs(pid_t pid) {
  std::ifstream stream("/proc/" + std::to_string(pid) + "/stat");
  const std::string text{std::istreambuf_iterator<char>(stream), {}};
  const std::size_t end = text.rfind(')');
  if (end == std::string::npos) {
    return std::nullopt;
  }
  std::istringstream fields(text.substr(end + 1));
  std::string skipped;
  for (int field = 3; field < kUserTime; ++field) {
    fields >> skipped;
  }
  std::int64_t user = 0, system = 0;
  if (!(fields >> user >> system)) {
    return std::nullopt;
  }
  return (user + system) * 1'000'000 / sysconf(_SC_CLK_TCK);
}

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
  const auto cpu_us = pid > 0 ? CpuUs(pid) : std::nullopt;
  const auto memory_mb = cpu_us ? ResidentMb(pid) : std::nullopt;
  if (!memory_mb) {
    samples_.erase(pid);
    return std::nullopt;
  }
  const auto [found, first] = samples_.try_emplace(pid, Sample{now_us, *cpu_us, std::nullopt});
  Sample& sample = found->second;
  const std::int64_t passed_us = now_us - sample.at_us;
  if (!first && passed_us >= kShortestUs) {
    sample = {now_us, *cpu_us,
              100.0 * static_cast<double>(*cpu_us - sample.cpu_us) / static_cast<double>(passed_us)};
  }
  return Usage{sample.percent, *memory_mb};
}

}  // namespace forgescan
