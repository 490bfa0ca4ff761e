// Which recordings may go. Pure: the caller lists the files and deletes what is chosen.
//
// For keep_days stays every part that is NOT_OK, not decidable, not inspected, without verdict or incomplete,
// every station's recording, and of the OK parts each whose number is a multiple of keep_every_nth_ok. The
// newest keep_newest_ok OK parts stay whatever their age. Beyond the quota go the oldest OK parts first, then
// the oldest others; never an open file, never the newest OK parts.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace forgescan {

struct RetentionRules {
  int keep_days = 30;
  int keep_every_nth_ok = 20;
  int keep_newest_ok = 200;
  std::int64_t quota_bytes = 500'000'000'000;
};

struct StoredRecording {
  std::string path;
  std::int64_t bytes = 0;
  bool open = false;  // being written now
};

struct Deletion {
  std::string path;
  std::int64_t bytes = 0;
  std::string reason;  // one clause
};

struct RetentionPlan {
  std::vector<Deletion> deletions;    // in the order in which they should go
  std::int64_t bytes_over_quota = 0;  // that may not be deleted
};

// Files whose names are not those of recordings are left alone and not counted.
RetentionPlan PlanRetention(const std::vector<StoredRecording>& files, const RetentionRules& rules,
                            std::int64_t now_us);

}  // namespace forgescan
