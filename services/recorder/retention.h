// Which recordings may go. Pure: the caller lists the files and deletes what is chosen.
//
// For keep_days stays every part that is NOT_OK, not decidable, not inspected, without verdict or incomplete,
// every station's recording, and of the OK parts each whose number is a multiple of keep_every_nth_ok. The
// newest keep_newest_ok OK parts stay whatever their age. Beyond the quota go the oldest OK parts first, then
// the oldest others. Where a disk has too little free, the oldest OK parts go, if that makes enough room; if
// not, or if there are only others, nothing goes for it. Never an open file, never the newest OK parts.
//
// A recording's time is that in its name or of its last change, the later of the two. It is not believed
// blindly, as a clock may have been wrong:
//   - before 2026 no recording was made, and none in the future: such a file is of unknown age, goes only
//   beyond
//     the quota, and takes no place among the newest;
//   - after a pause longer than keep_days nothing from before it is deleted by age until the recordings since
//     then span keep_days themselves: a clock that was set too far ahead looks like such a pause.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

namespace forgescan {

struct RetentionRules {
  int keep_days = 30;
  int keep_every_nth_ok = 20;
  int keep_newest_ok = 200;
  std::int64_t quota_bytes = 500'000'000'000;
  std::int64_t min_free_bytes = 0;  // on every disk with recordings
};

struct StoredRecording {
  std::string path;
  std::int64_t bytes = 0;
  bool open = false;            // being written now
  std::int64_t changed_us = 0;  // us since 1970 UTC of the last change; 0 = not known
  std::uint64_t disk = 0;       // equal for files on one disk
};

struct Deletion {
  std::string path;
  std::int64_t bytes = 0;
  std::string reason;  // one clause
};

struct RetentionPlan {
  std::vector<Deletion> deletions;    // in the order in which they should go
  std::int64_t bytes_over_quota = 0;  // that may not be deleted
  std::string doubt;  // why nothing goes by age that would otherwise; empty = nothing is held back
};

using FreeSpace = std::map<std::uint64_t, std::int64_t>;  // by disk

// Files whose names are not those of recordings are left alone and not counted. A disk that is not in `free`
// has room.
RetentionPlan PlanRetention(const std::vector<StoredRecording>& files, const RetentionRules& rules,
                            const FreeSpace& free, std::int64_t now_us);

}  // namespace forgescan
