// A running station: its processes under supervision, its bus, and what its services say.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "services/common/bus/lcm_bus.h"
#include "services/common/service/station.h"
#include "tools/forgescan/station/process_group.h"
#include "tools/forgescan/station/process_usage.h"
#include "tools/forgescan/station/state_table.h"
#include "tools/forgescan/station/station_lock.h"
#include "tools/forgescan/station/station_services.h"
#include "tools/forgescan/station/supervisor.h"
#include "tools/forgescan/station/supervisor_log.h"

namespace forgescan {

class StationRunner {
 public:
  // Opens the bus of the station in FOLDER, and takes its lock; RunFor() starts the services. Logs go to
  // FOLDER/log. Errors: as Station::Load, SupervisionPolicy::Load, StationLock::Take, LcmBus::Open.
  static Result<std::unique_ptr<StationRunner>> Create(const std::string& folder, Echo echo);

  // Every service is ready or working.
  bool AllReady() const { return table_.AllReady(names_); }
  // Errors: kUnavailable with the table, when a service did not become ready in time; as RunFor().
  Status WaitUntilReady(std::int64_t patience_us);
  // Handles what arrives on the bus for a while, and starts again what has ended or fallen silent. Errors:
  // kUnavailable (a service cannot work on this station, or was given up and the policy is to stop then).
  Status RunFor(std::int64_t duration_us);
  // Stops makers of parts first, the computing services when the parts in work have their verdict, the
  // recorder last. Errors: kUnavailable, naming what was given up before, failed while it stopped, or had to
  // be killed.
  Status Stop();

  LcmBus& bus() { return *bus_; }
  const Station& station() const { return station_; }
  int restarts() const { return supervisor_.restarts(); }
  SupervisorLog& log() { return log_; }
  // One row a service, for StateTable::Render.
  std::vector<TableRow> Rows();
  std::string Table(int width, bool colour) { return table_.Render(Rows(), width, colour); }

 private:
  struct Parts {
    Station station;
    SupervisionPolicy policy;
    StationLock lock;
    SupervisorLog log;
    std::unique_ptr<LcmBus> bus;
  };
  explicit StationRunner(Parts parts);

  Status Step();
  void Carry(const Supervisor::Actions& actions);
  void Do(const StartProcess& start);
  void Do(const KillProcess& kill);
  void Do(const SupervisorEvent& event);
  ServiceProcesses Processes() const;
  void NoteProcesses();
  void Drain();
  void StopStage(StationStage stage);
  void StopOne(const std::string& name);
  // True once it has ended; an end that is none in order is noted.
  bool HasStopped(const std::string& name);
  Status StopOutcome() const;
  // Until the condition holds, handling what arrives on the bus. False: not within that time.
  template <typename Condition>
  bool WaitFor(double patience_s, const Condition& condition);

  Station station_;
  SupervisionPolicy policy_;
  StationLock lock_;
  SupervisorLog log_;
  std::unique_ptr<LcmBus> bus_;
  StateTable table_;
  std::vector<std::string> names_;
  Supervisor supervisor_;
  ProcessUsage usage_;
  ServiceProcesses noted_;                // in the lock's file
  bool note_failed_ = false;              // the last time
  std::vector<std::string> stop_faults_;  // sentences
  ProcessGroup processes_;
};

// The folder of this program, where the others are.
std::string ProgramFolder();

}  // namespace forgescan
