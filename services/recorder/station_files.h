// The files of the station that go into every recording, so that it can be computed again from itself alone.
#pragma once

#include <string>
#include <vector>

#include "fsmsg/recorded_file_t.hpp"
#include "services/common/result.h"
#include "services/common/service/station.h"

namespace forgescan {

inline constexpr std::int64_t kMaxStationFileBytes = 60'000'000;

struct StationFile {
  std::string name;  // as in recorded_file_t
  std::string path;
};

// station.toml, and by role with the file's own extension: calibration.yaml, pattern.toml, views.toml,
// model.bundle, features.toml, and standing.ply if the station has one. Errors: kNotFound, kInvalidArgument (larger than
// kMaxStationFileBytes), of the first that is wrong.
Result<std::vector<StationFile>> StationFilesOf(const Station& station);

// utime is left 0. Errors: kNotFound, kIo, kInvalidArgument (larger than kMaxStationFileBytes).
Result<fsmsg::recorded_file_t> ReadStationFile(const StationFile& file);

}  // namespace forgescan
