#include "services/trigger/trigger_config.h"

#include <algorithm>
#include <cmath>

namespace forgescan {

Status TriggerConfig::Check() const {
  if (exposure_us < 10 || exposure_us > 40'950 || exposure_us % 10 != 0) {
    return Fail(ErrorCode::kInvalidArgument,
                "trigger: exposure_us {} is not a multiple of 10 within 10..40950", exposure_us);
  }
  if (patterns < 1 || first_pattern < 0 || first_pattern + patterns > 32) {
    return Fail(ErrorCode::kInvalidArgument, "trigger: patterns {}..{} are not within 0..31", first_pattern,
                first_pattern + patterns - 1);
  }
  if (frame_bytes <= 0 || !(link_mbit_s > 0) || !(link_efficiency > 0 && link_efficiency <= 1) ||
      margin_us < 0) {
    return Fail(ErrorCode::kInvalidArgument,
                "trigger: frame_bytes {}, link_mbit_s {}, link_efficiency {}, margin_us {} do not "
                "make a link",
                frame_bytes, link_mbit_s, link_efficiency, margin_us);
  }
  const auto plan = PlanTrigger(*this);
  return plan.ok() ? Status() : Status(plan.error());
}

Result<TriggerConfig> TriggerConfig::Load(ConfigTable table) {
  TriggerConfig config;
  table.Optional("exposure_us", config.exposure_us, 10, 40'950);
  table.Optional("patterns", config.patterns, 1, 32);
  table.Optional("first_pattern", config.first_pattern, 0, 31);
  table.Optional("period_us", config.period_us, 0, 10'000'000);
  table.Optional("margin_us", config.margin_us, 0, 100'000);
  table.Optional("frame_bytes", config.frame_bytes, 1, 100'000'000);
  table.Optional("link_mbit_s", config.link_mbit_s, 1, 100'000);
  table.Optional("link_efficiency", config.link_efficiency, 0.1, 1);
  table.Optional("echo_timeout_ms", config.echo_timeout_ms, 5, 1000);
  table.Optional("resends", config.resends, 0, 10);
  table.Optional("record_timeout_ms", config.record_timeout_ms, 10, 10'000);
  RETURN_IF_ERROR(table.Finish());
  RETURN_IF_ERROR(config.Check());
  return config;
}

Result<TriggerPlan> PlanTrigger(const TriggerConfig& config) {
  constexpr int kLongestPeriod_us = (1 << 24) - 1;  // on the wire
  TriggerPlan plan;
  const double bits = 8.0 * static_cast<double>(config.frame_bytes);
  const double transfer_us = std::ceil(bits / (config.link_mbit_s * config.link_efficiency));
  const double shortest_us = 2 * (std::max<double>(config.exposure_us, transfer_us) + config.margin_us);
  if (!(shortest_us <= kLongestPeriod_us) || config.period_us > kLongestPeriod_us) {
    return Fail(ErrorCode::kInvalidArgument, "trigger: period {} us, needed {} us, is above {} us",
                config.period_us, shortest_us, kLongestPeriod_us);
  }
  if (config.period_us != 0 && config.period_us < shortest_us) {
    return Fail(
        ErrorCode::kInvalidArgument,
        "trigger: period_us {} is below {} us = 2 x (max(exposure {} us, transfer {} us) + margin {} us)",
        config.period_us, shortest_us, config.exposure_us, transfer_us, config.margin_us);
  }
  plan.transfer_us = static_cast<int>(transfer_us);
  plan.period_us = config.period_us != 0 ? config.period_us : static_cast<int>(shortest_us);
  plan.view_us =
      std::int64_t{plan.period_us} * (config.patterns - 1) + plan.period_us / 2 + config.exposure_us;
  return plan;
}

}  // namespace forgescan
