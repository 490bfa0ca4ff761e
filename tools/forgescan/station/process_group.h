// The processes of a station: started with their output in log files, watched, stopped in reverse order.
#pragma once

#include <sys/types.h>

#include <string>
#include <vector>

#include "services/common/result.h"

namespace forgescan {

class ProcessGroup {
 public:
  // Output of the processes goes to LOG_FOLDER/NAME.log.
  explicit ProcessGroup(std::string log_folder) : log_folder_(std::move(log_folder)) {}
  ProcessGroup(const ProcessGroup&) = delete;
  ProcessGroup& operator=(const ProcessGroup&) = delete;
  ~ProcessGroup() { Stop(); }

  // Errors: kIo (no such program, no log file).
  Status Start(const std::string& name, const std::vector<std::string>& command);
  // Name, fate and last words of the first process that has ended since the last call; empty = all run.
  std::string Ended();
  // Waits for all to end by themselves. Errors: kUnavailable (one failed; the end of its log is in the
  // sentence).
  Status WaitForSuccess();
  // Sends a signal to all.
  void Signal(int signal) const;
  // SIGTERM to one after the other, last started first; SIGKILL for one that has not ended after 10 s.
  void Stop();

 private:
  struct Process {
    std::string name;
    pid_t pid;
  };
  static bool WaitForEnd(pid_t pid);
  std::string LogOf(const std::string& name) const { return log_folder_ + "/" + name + ".log"; }

  std::string log_folder_;
  std::vector<Process> processes_;
};

}  // namespace forgescan
