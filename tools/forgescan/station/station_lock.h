// FOLDER/station.pid: which process runs the station, and those of its services. Held under a lock while the
// station is up, so that a file left behind by a crash says only what may still run.
//
//   PID STARTED_TICKS STOP_PATIENCE_S       of the supervisor
//   NAME PID RESTARTS STARTED_TICKS GIVEN_UP   one line a service; or, as the last word, one line
//   stopped SENTENCE                        how the stop went; no sentence: in order
#pragma once

#include <map>
#include <string>
#include <utility>

#include "services/common/locked_file.h"
#include "services/common/result.h"
#include "tools/forgescan/station/process_id.h"

namespace forgescan {

struct ServiceProcess {
  ProcessId process;  // pid 0: not running
  int restarts = 0;
  bool given_up = false;
  bool operator==(const ServiceProcess&) const = default;
};
using ServiceProcesses = std::map<std::string, ServiceProcess>;

// A station that is up, as somebody else than its supervisor sees it. Looking takes no lock.
class RunningStation {
 public:
  // Errors: kNotFound (the station is not up).
  static Result<RunningStation> Find(const std::string& folder);

  pid_t pid() const { return supervisor_.pid; }
  // The longest an ordered stop can take.
  double stop_patience_s() const { return stop_patience_s_; }
  // As they were when the station was found.
  const ServiceProcesses& services() const { return services_; }
  bool IsUp() const;
  // Once it is not up any more: how it stopped. Errors: kUnavailable (not in order, with the sentence).
  Status Outcome() const;

 private:
  explicit RunningStation(OwnedFd file) : file_(std::move(file)) {}

  OwnedFd file_;  // can still be read when it has been removed
  ProcessId supervisor_;
  double stop_patience_s_ = 0;
  ServiceProcesses services_;
};

// Held by whoever runs the station. Removes the file at its end, unless it names what may still run.
class StationLock {
 public:
  // Errors: kUnavailable (somebody else holds it), kIo (no such file can be made, or none be locked here).
  static Result<StationLock> Take(const std::string& folder, double stop_patience_s);
  StationLock(StationLock&&) = default;
  StationLock& operator=(StationLock&&) = delete;
  ~StationLock();

  // Of naming this process in the file when it was taken. The lock holds without it, but others do not find
  // the station until a Write() succeeds.
  const Status& named() const { return named_; }
  // Services of an earlier supervisor that did not stop in order. They may still run.
  const ServiceProcesses& left_behind() const { return left_behind_; }
  // None of them runs any more. Until then the file stays for the next one to take.
  void LeftBehindHaveEnded() { left_behind_.clear(); }
  // Errors: kIo.
  Status Write(const ServiceProcesses& services) const;
  // The last word, for RunningStation::Outcome(). Errors: kIo.
  Status WriteOutcome(const Status& outcome) const;

 private:
  StationLock(std::string path, OwnedFd file, double stop_patience_s)
      : path_(std::move(path)), file_(std::move(file)), stop_patience_s_(stop_patience_s) {}
  Status WriteText(const std::string& text) const;

  std::string path_;
  OwnedFd file_;
  double stop_patience_s_;
  ServiceProcesses left_behind_;
  Status named_;
};

}  // namespace forgescan
