// FOLDER/station.pid: which process runs the station, and those of its services. Held under a lock while the
// station is up, so that a file left behind by a crash names nobody.
#pragma once

#include <sys/types.h>

#include <map>
#include <string>

#include "services/common/result.h"

namespace forgescan {

struct ServiceProcess {
  pid_t pid = 0;  // 0: not running
  int restarts = 0;
  bool operator==(const ServiceProcess&) const = default;
};

struct StationProcesses {
  pid_t pid = 0;  // that runs the station
  std::map<std::string, ServiceProcess> services;
};

// Errors: kNotFound (the station is not up).
Result<StationProcesses> RunningStation(const std::string& folder);

// Held by whoever runs the station.
class StationLock {
 public:
  // Errors: kUnavailable (somebody else holds it), kIo (not to be written).
  static Result<StationLock> Take(const std::string& folder);
  StationLock(StationLock&& other) noexcept;
  StationLock& operator=(StationLock&&) = delete;
  ~StationLock();

  Status Write(const std::map<std::string, ServiceProcess>& services) const;

 private:
  StationLock(std::string path, int fd) : path_(std::move(path)), fd_(fd) {}

  std::string path_;
  int fd_;
};

}  // namespace forgescan
