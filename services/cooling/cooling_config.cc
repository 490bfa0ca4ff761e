#include "services/cooling/cooling_config.h"

namespace forgescan {

Status CoolingConfig::Check() const {
  if (!(warn_degc < stop_degc && stop_degc < power_off_degc && setpoint_degc < warn_degc)) {
    return Fail(ErrorCode::kInvalidArgument,
                "cooling: set-point {} < warn {} < stop {} < power off {} degC does not hold", setpoint_degc,
                warn_degc, stop_degc, power_off_degc);
  }
  const bool gains = kp_per_k > 0 && ki_per_k_s > 0 && kff_per_k >= 0 && max_slew_per_s > 0;
  const bool duties = safe_duty >= 0 && safe_duty <= max_duty && max_duty > 0 && max_duty <= 1;
  if (!gains || !duties) {
    return Fail(ErrorCode::kInvalidArgument,
                "cooling: gains {}, {}, {}, slew {} must be above 0 and duties safe {} <= max {} within 0..1",
                kp_per_k, ki_per_k_s, kff_per_k, max_slew_per_s, safe_duty, max_duty);
  }
  if (!(min_difference_k < max_difference_k && min_valid_degc < max_valid_degc &&
        dew_off_margin_k < dew_margin_k)) {
    return Fail(ErrorCode::kInvalidArgument, "cooling: a lower limit is not below its upper limit");
  }
  return {};
}

Result<CoolingConfig> CoolingConfig::Load(ConfigTable table) {
  CoolingConfig config;
  table.Optional("setpoint_degc", config.setpoint_degc, 0, 60);
  table.Optional("kp_per_k", config.kp_per_k, 1e-6, 100);
  table.Optional("ki_per_k_s", config.ki_per_k_s, 1e-6, 100);
  table.Optional("kff_per_k", config.kff_per_k, 0, 100);
  table.Optional("max_duty", config.max_duty, 0.01, 1);
  table.Optional("max_slew_per_s", config.max_slew_per_s, 1e-3, 1);
  table.Optional("safe_duty", config.safe_duty, 0, 1);
  table.Optional("blind_stop_s", config.blind_stop_s, 0, 600);
  table.Optional("warn_degc", config.warn_degc, 0, 80);
  table.Optional("stop_degc", config.stop_degc, 0, 80);
  table.Optional("power_off_degc", config.power_off_degc, 0, 80);
  table.Optional("hot_side_off_degc", config.hot_side_off_degc, 30, 120);
  table.Optional("hysteresis_k", config.hysteresis_k, 0.1, 20);
  table.Optional("min_flow_lpm", config.min_flow_lpm, 0, 10'000);
  table.Optional("dew_margin_k", config.dew_margin_k, 0, 20);
  table.Optional("dew_off_margin_k", config.dew_off_margin_k, 0, 20);
  table.Optional("assumed_humidity_pct", config.assumed_humidity_pct, 1, 100);
  table.Optional("max_cooling_k", config.max_cooling_k, 0.1, 50);
  RETURN_IF_ERROR(table.Finish());
  RETURN_IF_ERROR(config.Check());
  return config;
}

}  // namespace forgescan
