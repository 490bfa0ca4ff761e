// The station a session was recorded on, made again from the recording's own files, with the changes a user
// asks for.
#pragma once

#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "services/common/service/station.h"
#include "tools/forgescan/replay/recorded_session.h"

namespace forgescan {

struct StationChanges {
  std::string config;                        // another station.toml; empty = the recorded one
  std::vector<std::string> values;           // "table.key=value", value as in TOML
  std::map<std::string, std::string> files;  // by role (calibration, pattern, views, model, features, standing)
  bool Any() const { return !config.empty() || !values.empty() || !files.empty(); }
};

// Errors: kInvalidArgument (a change of a value or file that none of the services reads, which are named as
// in ReplayableService: it would change nothing).
Status CheckUsed(const StationChanges& changes, const std::vector<std::string>& services);

// Writes the recorded files with the changes to `folder` (which exists and is empty) and loads the station
// from it. Results go to `folder`/results. Errors: kNotFound (a file the station needs is not in the
// recording, or a file the user named does not exist), kInvalidArgument (a value that is no table.key=value),
// kIo, and those of Station::Load.
Result<Station> UnpackStation(const RecordedSession& session, const StationChanges& changes,
                              const std::filesystem::path& folder);

// How the station's files differ from the recorded ones, one line each: "registration.start_rotation_rad =
// 0.06, recorded as 0.03", "calibration is another file: PATH". Errors: kFormat, kIo.
Result<std::vector<std::string>> DescribeChanges(const RecordedSession& session, const Station& station);

}  // namespace forgescan
