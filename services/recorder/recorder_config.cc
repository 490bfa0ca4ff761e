#include "services/recorder/recorder_config.h"

namespace forgescan {

RetentionRules RecorderConfig::retention() const {
  return {.keep_days = keep_days,
          .keep_every_nth_ok = keep_every_nth_ok,
          .keep_newest_ok = keep_newest_ok,
          .quota_bytes = quota_gb * std::int64_t{1'000'000'000}};
}

Status RecorderConfig::Check() const {
  if (folder.empty()) {
    return Fail(ErrorCode::kInvalidArgument, "recorder: folder is empty");
  }
  if (!(settle_s > 0 && settle_s < sorted_timeout_s && sorted_timeout_s < part_timeout_s)) {
    return Fail(ErrorCode::kInvalidArgument,
                "recorder: 0 < settle_s {} < sorted_timeout_s {} < part_timeout_s {} s does not hold",
                settle_s, sorted_timeout_s, part_timeout_s);
  }
  if (backlog_mb < 100 || backlog_mb > 16'000 || min_free_mb < 0 || station_volume_mb < 1) {
    return Fail(
        ErrorCode::kInvalidArgument,
        "recorder: backlog_mb {} is outside 100..16000, min_free_mb {} below 0, or station_volume_mb {} "
        "below 1",
        backlog_mb, min_free_mb, station_volume_mb);
  }
  if (keep_days < 1 || keep_every_nth_ok < 1 || keep_newest_ok < 0 || quota_gb < 1) {
    return Fail(ErrorCode::kInvalidArgument,
                "recorder: keep_days {}, keep_every_nth_ok {} and quota_gb {} must be at least 1, "
                "keep_newest_ok {} at least 0",
                keep_days, keep_every_nth_ok, quota_gb, keep_newest_ok);
  }
  return {};
}

Result<RecorderConfig> RecorderConfig::Load(ConfigTable table) {
  RecorderConfig config;
  table.Optional("folder", config.folder);
  table.Optional("settle_s", config.settle_s, 0.1, 6);  // a stopping station waits no longer
  table.Optional("sorted_timeout_s", config.sorted_timeout_s, 1, 600);
  table.Optional("part_timeout_s", config.part_timeout_s, 10, 3600);
  table.Optional("backlog_mb", config.backlog_mb, 100, 16'000);
  table.Optional("min_free_mb", config.min_free_mb, 0, 1'000'000);
  table.Optional("station_volume_mb", config.station_volume_mb, 1, 100'000);
  table.Optional("keep_days", config.keep_days, 1, 3650);
  table.Optional("keep_every_nth_ok", config.keep_every_nth_ok, 1, 1'000'000);
  table.Optional("keep_newest_ok", config.keep_newest_ok, 0, 1'000'000);
  table.Optional("quota_gb", config.quota_gb, 1, 1'000'000);
  RETURN_IF_ERROR(table.Finish());
  RETURN_IF_ERROR(config.Check());
  return config;
}

}  // namespace forgescan
