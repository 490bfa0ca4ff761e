#include "tools/forgescan/station/leftovers.h"

#include <poll.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <csignal>
#include <fstream>

namespace forgescan {
namespace {

using SteadyClock = std::chrono::steady_clock;
constexpr int kKillPatienceMs = 5000;

// Numbers and ticks may meet again after the computer was booted, but hardly in a program of ours.
bool IsOurs(const ProcessId& process) {
  std::ifstream stream("/proc/" + std::to_string(process.pid) + "/comm");
  std::string name;
  return std::getline(stream, name) && name.starts_with("forgescan-") && process.Runs();
}

bool EndsWithin(int process_fd, std::int64_t patience_ms) {
  pollfd ended{process_fd, POLLIN, 0};
  return poll(&ended, 1, static_cast<int>(std::max<std::int64_t>(0, patience_ms))) == 1;
}

}  // namespace

Status EndLeftovers(const ServiceProcesses& left_behind, const SupervisionPolicy& policy,
                    SupervisorLog& log) {
  const auto begin = SteadyClock::now();
  for (const auto& [name, service] : left_behind) {
    const pid_t pid = service.process.pid;
    const OwnedFd process(
        static_cast<int>(syscall(SYS_pidfd_open, pid, 0)));  // no later process has its number
    if (process.get() < 0 || !IsOurs(service.process)) {
      continue;
    }
    log.Write(name, fmt::format("still runs as process {}, left behind by an earlier supervisor", pid), true);
    const auto waited = std::chrono::duration_cast<std::chrono::milliseconds>(SteadyClock::now() - begin);
    if (EndsWithin(process.get(),
                   static_cast<std::int64_t>(1e3 * policy.StopPatienceS(name)) - waited.count())) {
      continue;
    }
    log.Write(name, fmt::format("process {} hangs: KILLED", pid), true);
    if (syscall(SYS_pidfd_send_signal, process.get(), SIGKILL, nullptr, 0) != 0 ||
        !EndsWithin(process.get(), kKillPatienceMs)) {
      return Fail(ErrorCode::kUnavailable, "{} still runs as process {} and cannot be killed; end it first",
                  name, pid);
    }
  }
  return {};
}

}  // namespace forgescan
