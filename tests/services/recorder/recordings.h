// What a recorder has left in its folder, as a reader finds it.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "fsmsg/recording_closed_t.hpp"
#include "fsmsg/recording_opened_t.hpp"
#include "services/recorder/recording_name.h"
#include "tests/common/log/read_log.h"

namespace forgescan::testing {

struct Recording {
  std::string path;
  RecordingName name;
  std::vector<LogEvent> events;
  fsmsg::recording_opened_t opened;
  std::optional<fsmsg::recording_closed_t> closed;

  // Messages on a channel.
  std::vector<Bytes> On(const std::string& channel) const;
};

// Every recording below the folder, in the order of their names. Checks what holds of every one: the first
// event opens it, a closing event is the last and its totals are true, times never step back.
std::vector<Recording> ReadRecordings(const std::filesystem::path& folder);
// Those of a part; those of the station.
std::vector<Recording> OfPart(const std::vector<Recording>& recordings, int part);
std::vector<Recording> OfStation(const std::vector<Recording>& recordings);

}  // namespace forgescan::testing
