// The processes of a station: started with their output in log files, watched, stopped in reverse order.
#pragma once

#include <sys/types.h>

#include <optional>
#include <string>
#include <vector>

#include "services/common/result.h"
#include "tools/forgescan/station/process_id.h"
#include "tools/forgescan/station/supervisor.h"

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
  // The first process that has ended and was not told of; nothing = all run.
  std::optional<ProcessEnd> Ended();
  // {} = no such process, or its end has been told.
  ProcessId IdOf(const std::string& name) const;
  pid_t PidOf(const std::string& name) const { return IdOf(name).pid; }
  // Waits for all to end by themselves. Errors: kUnavailable (one failed; the end of its log is in the
  // sentence).
  Status WaitForSuccess();
  // Sends a signal to all, or to one.
  void Signal(int signal) const;
  void Signal(const std::string& name, int signal) const;
  // How this one ended; it is then forgotten. Nothing = it runs, or there is no such process.
  std::optional<ProcessEnd> EndOf(const std::string& name);
  // SIGTERM to one after the other, last started first; SIGKILL for one that has not ended after 10 s.
  void Stop();

 private:
  struct Process {
    std::string name;
    ProcessId id;
  };
  using Iterator = std::vector<Process>::iterator;
  static bool WaitForEnd(pid_t pid);
  std::optional<ProcessEnd> TakeIfEnded(Iterator process);
  ProcessEnd Describe(const Process& process, int status) const;
  std::string LogOf(const std::string& name) const { return log_folder_ + "/" + name + ".log"; }

  std::string log_folder_;
  std::vector<Process> processes_;
};

}  // namespace forgescan
