// Settings of the recorder; the only home of their defaults.
#pragma once

#include "services/common/config/config.h"
#include "services/recorder/retention.h"

namespace forgescan {

struct RecorderConfig {
  std::string folder = "recordings";  // from the station's folder
  double settle_s = 2;                // without news of a sorted part before its file is closed
  double sorted_timeout_s = 30;       // for PART_SORTED after the verdict
  double part_timeout_s = 240;        // without news of a part that has no verdict
  int backlog_mb = 1500;              // received and not yet written; beyond it messages are dropped as gaps
  int min_free_mb = 4000;             // on the disk, more than two parts; with less OK parts may go
  int station_volume_mb = 1000;       // of the station's own recording; a new one also begins every day (UTC)
  int keep_days = RetentionRules{}.keep_days;
  int keep_every_nth_ok = RetentionRules{}.keep_every_nth_ok;
  int keep_newest_ok = RetentionRules{}.keep_newest_ok;
  int quota_gb = 500;

  std::int64_t backlog_bytes() const { return backlog_mb * std::int64_t{1'000'000}; }
  std::int64_t min_free_bytes() const { return min_free_mb * std::int64_t{1'000'000}; }
  RetentionRules retention() const;

  // Errors: kInvalidArgument, naming the field and its range.
  Status Check() const;
  // Reads the table [recorder].
  static Result<RecorderConfig> Load(ConfigTable table);
};

}  // namespace forgescan
