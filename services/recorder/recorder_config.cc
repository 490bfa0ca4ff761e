#include "services/recorder/recorder_config.h"

namespace forgescan {

RetentionRules RecorderConfig::retention() const {
  return {.keep_days = keep_days,
          .keep_every_nth_ok = keep_every_nth_ok,
          .keep_newest_ok = keep_newest_ok,
          .quota_bytes = quota_gb * std::int64_t{1'000'000'000},
          .min_free_bytes = min_free_bytes()};
}

namespace {

template <typename Number>
struct Range {
  const char* key;
  Number RecorderConfig::*field;
  Number least, most;
};

constexpr Range<double> kTimes[] = {
    {"settle_s", &RecorderConfig::settle_s, 0.1, 6},  // a stopping station waits no longer
    {"sorted_timeout_s", &RecorderConfig::sorted_timeout_s, 1, 600},
    {"part_timeout_s", &RecorderConfig::part_timeout_s, 10, 3600},
};
constexpr Range<int> kNumbers[] = {
    {"backlog_mb", &RecorderConfig::backlog_mb, 100, 16'000},
    {"min_free_mb", &RecorderConfig::min_free_mb, 0, 1'000'000},
    {"station_volume_mb", &RecorderConfig::station_volume_mb, 1, 100'000},
    {"keep_days", &RecorderConfig::keep_days, 1, 3650},
    {"keep_every_nth_ok", &RecorderConfig::keep_every_nth_ok, 1, 1'000'000},
    {"keep_newest_ok", &RecorderConfig::keep_newest_ok, 0, 1'000'000},
    {"quota_gb", &RecorderConfig::quota_gb, 1, 1'000'000},
};

template <typename Number>
Status CheckRange(const RecorderConfig& config, const Range<Number>& range) {
  const Number value = config.*range.field;
  return value >= range.least && value <= range.most
             ? Status()
             : Status(Fail(ErrorCode::kInvalidArgument, "recorder: {} {} is outside {}..{}", range.key, value,
                           range.least, range.most));
}

}  // namespace

Status RecorderConfig::Check() const {
  if (folder.empty()) {
    return Fail(ErrorCode::kInvalidArgument, "recorder: folder is empty");
  }
  for (const auto& range : kTimes) {
    RETURN_IF_ERROR(CheckRange(*this, range));
  }
  for (const auto& range : kNumbers) {
    RETURN_IF_ERROR(CheckRange(*this, range));
  }
  if (!(settle_s < sorted_timeout_s && sorted_timeout_s < part_timeout_s)) {
    return Fail(ErrorCode::kInvalidArgument,
                "recorder: settle_s {} < sorted_timeout_s {} < part_timeout_s {} s does not hold", settle_s,
                sorted_timeout_s, part_timeout_s);
  }
  return {};
}

Result<RecorderConfig> RecorderConfig::Load(ConfigTable table) {
  RecorderConfig config;
  table.Optional("folder", config.folder);
  for (const auto& range : kTimes) {
    table.Optional(range.key, config.*range.field, range.least, range.most);
  }
  for (const auto& range : kNumbers) {
    table.Optional(range.key, config.*range.field, range.least, range.most);
  }
  RETURN_IF_ERROR(table.Finish());
  RETURN_IF_ERROR(config.Check());
  return config;
}

}  // namespace forgescan
