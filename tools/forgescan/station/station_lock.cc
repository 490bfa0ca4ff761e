#include "tools/forgescan/station/station_lock.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <optional>
#include <sstream>

namespace forgescan {
namespace {

constexpr const char* kStopped = "stopped";

std::string PidFile(const std::string& folder) {
  return (std::filesystem::path(folder) / "station.pid").string();
}

std::string ReadAll(int fd) {
  std::string text;
  std::array<char, 4096> buffer{};
  for (ssize_t got = 0;
       (got = pread(fd, buffer.data(), buffer.size(), static_cast<off_t>(text.size()))) > 0;) {
    text.append(buffer.data(), static_cast<std::size_t>(got));
  }
  return text;
}

struct Content {
  ProcessId supervisor;
  double stop_patience_s = 0;
  ServiceProcesses services;
  std::optional<std::string> outcome;  // nothing: it has not stopped
};

Content Parse(const std::string& text) {
  Content content;
  std::istringstream lines(text);
  lines >> content.supervisor.pid >> content.supervisor.started_ticks >> content.stop_patience_s;
  for (std::string line; std::getline(lines, line);) {
    std::istringstream words(line);
    std::string name;
    ServiceProcess service;
    if (line.starts_with(kStopped)) {
      content.outcome = line.substr(std::min(line.size(), std::strlen(kStopped) + 1));
    } else if (words >> name >> service.process.pid >> service.restarts >> service.process.started_ticks >>
               service.given_up) {
      content.services[name] = service;
    }
  }
  return content;
}

bool IsTheFileAt(const std::string& path, int fd) {
  struct stat opened {
  }, there{};
  return fstat(fd, &opened) == 0 && stat(path.c_str(), &there) == 0 && opened.st_dev == there.st_dev &&
         opened.st_ino == there.st_ino;
}

}  // namespace

Result<RunningStation> RunningStation::Find(const std::string& folder) {
  RunningStation station(OwnedFd(open(PidFile(folder).c_str(), O_RDONLY | O_CLOEXEC)));
  Content content = Parse(ReadAll(station.file_.get()));
  station.supervisor_ = content.supervisor;
  station.stop_patience_s_ = content.stop_patience_s;
  station.services_ = std::move(content.services);
  // Between taking the lock and the first write the file still names the supervisor before.
  if (!station.IsUp() || !station.supervisor_.Runs()) {
    return Fail(ErrorCode::kNotFound, "station {} is not up", folder);
  }
  return station;
}

bool RunningStation::IsUp() const { return IsLockedByAnother(file_); }

Status RunningStation::Outcome() const {
  const auto outcome = Parse(ReadAll(file_.get())).outcome;
  if (!outcome.has_value()) {
    return Fail(ErrorCode::kUnavailable,
                "process {} of the station ended without stopping its services in order", supervisor_.pid);
  }
  return outcome->empty() ? Status() : Fail(ErrorCode::kUnavailable, "{}", *outcome);
}

Result<StationLock> StationLock::Take(const std::string& folder, double stop_patience_s) {
  const std::string path = PidFile(folder);
  for (;;) {
    auto file = LockFile(path);
    if (!file.ok()) {
      return file.error().code == ErrorCode::kUnavailable
                 ? Fail(ErrorCode::kUnavailable,
                        "station {} is up already; forgescan station down {} stops it", folder, folder)
                 : file.error();
    }
    if (!IsTheFileAt(path, file->get())) {
      continue;  // the station went down, and its file with it, between open and lock
    }
    StationLock lock(path, std::move(*file), stop_patience_s);
    lock.left_behind_ = Parse(ReadAll(lock.file_.get())).services;
    lock.named_ = lock.Write(lock.left_behind_);  // still named if this process dies, too
    return lock;
  }
}

StationLock::~StationLock() {
  if (file_.get() >= 0 && left_behind_.empty()) {
    std::error_code ignored;  // a file left behind is not locked
    std::filesystem::remove(path_, ignored);
  }
}

Status StationLock::Write(const ServiceProcesses& services) const {
  std::string text;
  for (const auto& [name, service] : services) {
    text += fmt::format("{} {} {} {} {:d}\n", name, service.process.pid, service.restarts,
                        service.process.started_ticks, service.given_up);
  }
  return WriteText(text);
}

Status StationLock::WriteOutcome(const Status& outcome) const {
  std::string sentence = outcome.ok() ? "" : " " + outcome.error().message;
  std::replace(sentence.begin(), sentence.end(), '\n', ' ');
  return WriteText(kStopped + sentence + "\n");
}

Status StationLock::WriteText(const std::string& text) const {
  const ProcessId self = ProcessId::Of(getpid());
  const std::string whole =
      fmt::format("{} {} {:.0f}\n{}", self.pid, self.started_ticks, stop_patience_s_, text);
  const auto size = static_cast<ssize_t>(whole.size());
  const ssize_t written = pwrite(file_.get(), whole.data(), whole.size(), 0);
  if (written != size || ftruncate(file_.get(), size) != 0) {
    const int reason = written >= 0 && written < size ? ENOSPC : errno;
    return Fail(ErrorCode::kIo, "{}: cannot be written: {}", path_, std::strerror(reason));
  }
  return {};
}

}  // namespace forgescan
