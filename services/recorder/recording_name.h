// Names of recordings, and what they say of their content. Pure.
//
//   open, or left behind by a recorder that died:
//     parts/20261122T141507.123456Z_part000042.lcmlog.part
//   closed and complete, with the part's verdict:
//     parts/20261122T141507.123456Z_part000042_OK.lcmlog
//   closed, something is missing:
//     parts/20261122T141507.123456Z_part000042_NOT_OK_INCOMPLETE.lcmlog
//   of the station itself:
//     station/20261122T141507.123456Z.lcmlog
//
// They sort by time.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

namespace forgescan {

struct RecordingName {
  std::int64_t utime = 0;            // us since 1970 UTC of opening the file
  std::optional<std::int32_t> part;  // none: of the station
  std::int8_t verdict = 0;           // verdict_t.VERDICT_*
  bool complete = false;             // nothing is missing
  bool closed = false;
};

// Without folder. A part that is not closed bears no verdict.
std::string NameOf(const RecordingName& name);
// Of the name without folder; nothing for a file that is no recording.
std::optional<RecordingName> ParseRecordingName(std::string_view name);

}  // namespace forgescan
