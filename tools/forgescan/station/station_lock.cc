#include "tools/forgescan/station/station_lock.h"

#include <fcntl.h>
#include <sys/file.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <utility>

namespace forgescan {
namespace {

std::string PidFile(const std::string& folder) {
  return (std::filesystem::path(folder) / "station.pid").string();
}

}  // namespace

Result<StationProcesses> RunningStation(const std::string& folder) {
  const std::string path = PidFile(folder);
  const int fd = open(path.c_str(), O_RDONLY | O_CLOEXEC);
  const bool locked = fd >= 0 && flock(fd, LOCK_EX | LOCK_NB) != 0;
  close(fd);
  StationProcesses found;
  std::ifstream stream(path);
  std::string line;
  if (!locked || !(stream >> found.pid) || found.pid <= 0) {
    return Fail(ErrorCode::kNotFound, "station {} is not up", folder);
  }
  while (std::getline(stream, line)) {
    std::istringstream words(line);
    std::string name;
    ServiceProcess process;
    if (words >> name >> process.pid >> process.restarts) {
      found.services[name] = process;
    }
  }
  return found;
}

Result<StationLock> StationLock::Take(const std::string& folder) {
  const std::string path = PidFile(folder);
  const int fd = open(path.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0644);
  if (fd < 0) {
    return Fail(ErrorCode::kIo, "{} cannot be written: {}", path, std::strerror(errno));
  }
  if (flock(fd, LOCK_EX | LOCK_NB) != 0) {
    close(fd);
    return Fail(ErrorCode::kUnavailable, "station {} is up already; forgescan station down {} stops it",
                folder, folder);
  }
  StationLock lock(path, fd);
  RETURN_IF_ERROR(lock.Write({}));
  return lock;
}

StationLock::StationLock(StationLock&& other) noexcept
    : path_(std::move(other.path_)), fd_(std::exchange(other.fd_, -1)) {}

StationLock::~StationLock() {
  if (fd_ >= 0) {
    std::error_code ignored;  // a file left behind names nobody, as it is not locked
    std::filesystem::remove(path_, ignored);
    close(fd_);
  }
}

Status StationLock::Write(const std::map<std::string, ServiceProcess>& services) const {
  std::string text = std::to_string(getpid()) + "\n";
  for (const auto& [name, process] : services) {
    text += fmt::format("{} {} {}\n", name, process.pid, process.restarts);
  }
  const auto size = static_cast<ssize_t>(text.size());
  if (pwrite(fd_, text.data(), text.size(), 0) != size || ftruncate(fd_, size) != 0) {
    return Fail(ErrorCode::kIo, "{}: cannot be written: {}", path_, std::strerror(errno));
  }
  return {};
}

}  // namespace forgescan
