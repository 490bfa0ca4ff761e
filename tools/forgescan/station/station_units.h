// systemd units that run a station in production: systemd then is its supervisor, by the heartbeats of the
// services' working loops.
#pragma once

#include <string>
#include <vector>

#include "services/common/service/station.h"
#include "tools/forgescan/station/supervision_policy.h"

namespace forgescan {

struct UnitOptions {
  std::string folder;              // of the station
  std::string programs;            // folder of forgescan-NAME
  std::string user = "forgescan";  // account and group
  std::string out;                 // folder for the files
  std::string recordings;          // the recorder's folder
};

struct UnitFile {
  std::string name;  // of the file
  std::string text;
};

// One unit a service, one for the multicast route, and a target that joins them:
// forgescan-STATION.target. Pure; paths come out as they are given. Errors: kInvalidArgument (a station's
// name, user or path that cannot stand in a unit).
Result<std::vector<UnitFile>> MakeUnits(const Station& station, const SupervisionPolicy& policy,
                                        const UnitOptions& options);

// Writes them to options.out and says what to do with them. Errors: as above, as Station::Load, kIo.
Status WriteStationUnits(const UnitOptions& options);

}  // namespace forgescan
