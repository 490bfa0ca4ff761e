#include "tools/forgescan/station/process_group.h"

#include <fcntl.h>
#include <poll.h>
#include <spawn.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <unistd.h>

#include <csignal>
#include <cstring>
#include <filesystem>
#include <fstream>

namespace forgescan {
namespace {

constexpr int kStopPatienceMs = 10'000;

std::string Fate(int status) {
  return WIFSIGNALED(status) ? fmt::format("was killed by signal {}", WTERMSIG(status))
                             : fmt::format("ended with exit code {}", WEXITSTATUS(status));
}

std::string LastLine(const std::string& path) {
  std::ifstream stream(path);
  std::string last;
  for (std::string line; std::getline(stream, line);) {
    last = line.empty() ? last : line;
  }
  return last;
}

}  // namespace

Status ProcessGroup::Start(const std::string& name, const std::vector<std::string>& command) {
  std::filesystem::create_directories(log_folder_);
  const std::string log = log_folder_ + "/" + name + ".log";
  std::vector<char*> arguments;
  for (const std::string& word : command) {
    arguments.push_back(const_cast<char*>(word.c_str()));
  }
  arguments.push_back(nullptr);
  posix_spawn_file_actions_t files;
  posix_spawn_file_actions_init(&files);
  posix_spawn_file_actions_addopen(&files, STDIN_FILENO, "/dev/null", O_RDONLY, 0);
  posix_spawn_file_actions_addopen(&files, STDOUT_FILENO, log.c_str(), O_WRONLY | O_CREAT | O_APPEND, 0644);
  posix_spawn_file_actions_adddup2(&files, STDOUT_FILENO, STDERR_FILENO);
  posix_spawnattr_t
      attributes;  // a group of its own: Ctrl-C reaches the tool, and the tool stops the services in order
  posix_spawnattr_init(&attributes);
  sigset_t none;
  sigemptyset(&none);
  posix_spawnattr_setsigmask(&attributes, &none);
  posix_spawnattr_setpgroup(&attributes, 0);
  posix_spawnattr_setflags(&attributes, POSIX_SPAWN_SETPGROUP | POSIX_SPAWN_SETSIGMASK);
  pid_t pid = 0;
  const int outcome = posix_spawn(&pid, arguments[0], &files, &attributes, arguments.data(), environ);
  posix_spawn_file_actions_destroy(&files);
  posix_spawnattr_destroy(&attributes);
  if (outcome != 0) {
    return Fail(ErrorCode::kIo, "{} cannot be started with its log in {}: {}", command[0], log,
                std::strerror(outcome));
  }
  processes_.push_back({name, pid});
  return {};
}

std::string ProcessGroup::Ended() {
  for (auto process = processes_.begin(); process != processes_.end(); ++process) {
    int status = 0;
    if (waitpid(process->pid, &status, WNOHANG) == process->pid) {
      const std::string text =
          fmt::format("{} {}; see {}/{}.log", process->name, Fate(status), log_folder_, process->name);
      processes_.erase(process);
      return text;
    }
  }
  return {};
}

Status ProcessGroup::WaitForSuccess() {
  while (!processes_.empty()) {
    const Process process = processes_.back();
    int status = 0;
    waitpid(process.pid, &status, 0);
    processes_.pop_back();
    if (status != 0) {
      return Fail(ErrorCode::kUnavailable, "{} {}: {}", process.name, Fate(status),
                  LastLine(fmt::format("{}/{}.log", log_folder_, process.name)));
    }
  }
  return {};
}

void ProcessGroup::Signal(int signal) const {
  for (const Process& process : processes_) {
    kill(process.pid, signal);
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
    const pid_t pid = processes_.back().pid;
    kill(pid, SIGTERM);
    if (!WaitForEnd(pid)) {
      kill(pid, SIGKILL);
    }
    waitpid(pid, nullptr, 0);
    processes_.pop_back();
  }
}

}  // namespace forgescan
