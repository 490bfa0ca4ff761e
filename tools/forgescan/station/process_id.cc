#include "tools/forgescan/station/process_id.h"

#include <unistd.h>

#include <fstream>
#include <sstream>
#include <string>

namespace forgescan {
namespace {

// Fields of /proc/PID/stat, from 1.
constexpr int kState = 3, kUserTime = 14, kSystemTime = 15, kStartTime = 22;

}  // namespace

// The name in brackets may hold blanks and brackets, so fields count from the last one.
std::optional<ProcessStat> ReadProcessStat(pid_t pid) {
  std::ifstream stream("/proc/" + std::to_string(pid) + "/stat");
  const std::string text{std::istreambuf_iterator<char>(stream), {}};
  const std::size_t end = text.rfind(')');
  if (end == std::string::npos) {
    return std::nullopt;
  }
  std::istringstream fields(text.substr(end + 1));
  ProcessStat stat;
  std::int64_t ticks = 0;
  fields >> stat.state;
  for (int field = kState + 1; field <= kStartTime; ++field) {
    std::int64_t value = 0;
    fields >> value;
    ticks += field == kUserTime || field == kSystemTime ? value : 0;
    stat.started_ticks = value;
  }
  if (!fields) {
    return std::nullopt;
  }
  stat.cpu_us = ticks * 1'000'000 / sysconf(_SC_CLK_TCK);
  return stat;
}

ProcessId ProcessId::Of(pid_t pid) {
  const auto stat = ReadProcessStat(pid);
  return stat ? ProcessId{pid, stat->started_ticks} : ProcessId{};
}

bool ProcessId::Runs() const {
  const auto stat = pid > 0 ? ReadProcessStat(pid) : std::nullopt;
  return stat && stat->started_ticks == started_ticks && stat->state != 'Z' && stat->state != 'X';
}

}  // namespace forgescan
