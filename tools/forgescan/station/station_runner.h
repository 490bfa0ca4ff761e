// A running station: its processes, its bus, and what its services say.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "services/common/bus/lcm_bus.h"
#include "services/common/service/station.h"
#include "tools/forgescan/station/process_group.h"
#include "tools/forgescan/station/state_table.h"

namespace forgescan {

class StationRunner {
 public:
  // Opens the bus of the station in FOLDER and starts its services; logs go to FOLDER/log.
  static Result<std::unique_ptr<StationRunner>> Start(const std::string& folder);

  // Errors: kUnavailable with the service that ended or did not become ready in time.
  Status WaitUntilReady(std::int64_t patience_us);
  // Handles what arrives on the bus for a while. Errors: kUnavailable (a service ended).
  Status RunFor(std::int64_t duration_us);
  void Stop() { processes_.Stop(); }

  LcmBus& bus() { return *bus_; }
  const Station& station() const { return station_; }
  std::string Table(int width, bool colour) const { return table_.Render(names_, width, colour); }

 private:
  StationRunner(Station station, std::unique_ptr<LcmBus> bus);

  Station station_;
  std::unique_ptr<LcmBus> bus_;
  StateTable table_;
  std::vector<std::string> names_;
  ProcessGroup processes_;
};

// The folder of this program, where the others are.
std::string ProgramFolder();

}  // namespace forgescan
