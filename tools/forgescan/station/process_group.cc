#include "tools/forgescan/station/process_group.h"

#include <fcntl.h>
#include <poll.h>
#include <sys/prctl.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <csignal>
#include <cstring>
#include <filesystem>
#include <fstream>

namespace forgescan {
namespace {

constexpr int kStopPatienceMs = 10'000;

// Of the end of the file: a log may have grown for weeks.
std::string LastLine(const std::string& path) {
  constexpr std::streamoff kTailBytes = 4096;
  std::ifstream stream(path, std::ios::binary | std::ios::ate);
  const std::streamoff size = stream.tellg();
  stream.seekg(std::max<std::streamoff>(0, size - kTailBytes));
  std::string last;
  for (std::string line; std::getline(stream, line);) {
    last = line.empty() ? last : line;
  }
  return last;
}

// In the child: never returns. Only calls that are safe between fork and exec in a program with threads.
[[noreturn]] void Become(char* const* arguments, int log, pid_t parent) {
  prctl(PR_SET_PDEATHSIG, SIGTERM);  // services end with a tool that is killed
  if (getppid() != parent) {         // it was, before the call above
    _exit(127);
  }
  setpgid(0, 0);                  // Ctrl-C reaches the tool, and the tool stops the services in order
  std::signal(SIGPIPE, SIG_DFL);  // the tool may ignore it
  sigset_t none;
  sigemptyset(&none);
  sigprocmask(SIG_SETMASK, &none, nullptr);
  dup2(open("/dev/null", O_RDONLY), STDIN_FILENO);
  dup2(log, STDOUT_FILENO);
  dup2(log, STDERR_FILENO);
  execv(arguments[0], arguments);
  _exit(127);
}

}  // namespace

Status ProcessGroup::Start(const std::string& name, const std::vector<std::string>& command) {
  if (access(command[0].c_str(), X_OK) != 0) {
    return Fail(ErrorCode::kIo, "{} cannot be started: {}", command[0], std::strerror(errno));
  }
  std::error_code problem;
  std::filesystem::create_directories(log_folder_, problem);
  const int log = open(LogOf(name).c_str(), O_WRONLY | O_CREAT | O_APPEND | O_CLOEXEC, 0644);
  if (log < 0) {
    return Fail(ErrorCode::kIo, "{} is not started, as its log {} cannot be written: {}", command[0],
                LogOf(name), std::strerror(errno));
  }
  std::vector<char*> arguments;
  for (const std::string& word : command) {
    arguments.push_back(const_cast<char*>(word.c_str()));
  }
  arguments.push_back(nullptr);
  const pid_t self = getpid(), pid = fork();
  const int reason = errno;
  if (pid == 0) {
    Become(arguments.data(), log, self);
  }
  close(log);
  if (pid < 0) {
    return Fail(ErrorCode::kIo, "{} cannot be started: {}", command[0], std::strerror(reason));
  }
  processes_.push_back({name, ProcessId::Of(pid)});
  return {};
}

ProcessEnd ProcessGroup::Describe(const Process& process, int status) const {
  const bool killed = WIFSIGNALED(status);
  return {process.name, !killed, killed ? WTERMSIG(status) : WEXITSTATUS(status),
          LastLine(LogOf(process.name))};
}

std::optional<ProcessEnd> ProcessGroup::TakeIfEnded(Iterator process) {
  int status = 0;
  if (waitpid(process->id.pid, &status, WNOHANG) != process->id.pid) {
    return std::nullopt;
  }
  ProcessEnd end = Describe(*process, status);
  processes_.erase(process);
  return end;
}

std::optional<ProcessEnd> ProcessGroup::Ended() {
  for (auto process = processes_.begin(); process != processes_.end(); ++process) {
    if (auto end = TakeIfEnded(process)) {
      return end;
    }
  }
  return std::nullopt;
}

std::optional<ProcessEnd> ProcessGroup::EndOf(const std::string& name) {
  const auto process = std::ranges::find_if(processes_, [&](const Process& one) { return one.name == name; });
  return process == processes_.end() ? std::nullopt : TakeIfEnded(process);
}

ProcessId ProcessGroup::IdOf(const std::string& name) const {
  for (const Process& process : processes_) {
    if (process.name == name) {
      return process.id;
    }
  }
  return {};
}

Status ProcessGroup::WaitForSuccess() {
  while (!processes_.empty()) {
    const Process process = processes_.back();
    int status = 0;
    pid_t ended = -1;
    do {
      ended = waitpid(process.id.pid, &status, 0);
    } while (ended < 0 && errno == EINTR);
    processes_.pop_back();
    if (ended != process.id.pid || status != 0) {
      return Fail(ErrorCode::kUnavailable, "{} {}", process.name, Describe(process, status).Text());
    }
  }
  return {};
}

void ProcessGroup::Signal(const std::string& name, int signal) const {
  if (const pid_t pid = PidOf(name); pid != 0) {
    kill(pid, signal);
  }
}

void ProcessGroup::Signal(int signal) const {
  for (const Process& process : processes_) {
    kill(process.id.pid, signal);
  }
}

bool ProcessGroup::WaitForEnd(pid_t pid) {
  const int fd = static_cast<int>(syscall(SYS_pidfd_open, pid, 0));
  pollfd ended{fd, POLLIN, 0};
  const bool in_time = fd >= 0 && poll(&ended, 1, kStopPatienceMs) == 1;
  close(fd);
  return in_time;
}

void ProcessGroup::Stop() {
  while (!processes_.empty()) {
    const pid_t pid = processes_.back().id.pid;
    kill(pid, SIGTERM);
    if (!WaitForEnd(pid)) {
      kill(pid, SIGKILL);
    }
    waitpid(pid, nullptr, 0);
    processes_.pop_back();
  }
}

}  // namespace forgescan
