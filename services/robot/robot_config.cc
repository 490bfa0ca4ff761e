#include "services/robot/robot_config.h"

namespace forgescan {

Status RobotConfig::Check() const {
  if (path < 0 || path > 65535) {
    return Fail(ErrorCode::kInvalidArgument, "robot: path {} is outside 0..65535", path);
  }
  if (path_crc32 < 0 || path_crc32 > 0xFFFFFFFF) {
    return Fail(ErrorCode::kInvalidArgument, "robot: path_crc32 {} is outside 0..4294967295", path_crc32);
  }
  if (max_attempts < 1 || resends < 0 || sort_resends < 0 || echo_timeout_ms < 1 ||
      sort_echo_timeout_ms < 1) {
    return Fail(ErrorCode::kInvalidArgument,
                "robot: max_attempts {}, resends {} and {}, echo timeouts {} and {} ms are too low",
                max_attempts, resends, sort_resends, echo_timeout_ms, sort_echo_timeout_ms);
  }
  if (!(capture_timeout_s > 0 && home_timeout_s > 0 && gate_timeout_s > 0)) {
    return Fail(ErrorCode::kInvalidArgument, "robot: timeouts {}, {}, {} s must be above 0",
                capture_timeout_s, home_timeout_s, gate_timeout_s);
  }
  if (!(recording_timeout_s > 0)) {
    return Fail(ErrorCode::kInvalidArgument, "robot: recording_timeout_s {} must be above 0",
                recording_timeout_s);
  }
  return {};
}

Result<RobotConfig> RobotConfig::Load(ConfigTable table) {
  RobotConfig config;
  table.Optional("path", config.path, 0, 65535);
  table.Optional("path_crc32", config.path_crc32, 0, 0xFFFFFFFF);
  table.Optional("require_warm", config.require_warm);
  table.Optional("echo_timeout_ms", config.echo_timeout_ms, 5, 5000);
  table.Optional("resends", config.resends, 0, 10);
  table.Optional("max_attempts", config.max_attempts, 1, 10);
  table.Optional("capture_timeout_s", config.capture_timeout_s, 0.1, 600);
  table.Optional("home_timeout_s", config.home_timeout_s, 0.1, 600);
  table.Optional("sort_echo_timeout_ms", config.sort_echo_timeout_ms, 5, 5000);
  table.Optional("sort_resends", config.sort_resends, 0, 20);
  table.Optional("gate_timeout_s", config.gate_timeout_s, 0.1, 60);
  table.Optional("cooling_timeout_s", config.cooling_timeout_s, 0, 600);
  table.Optional("require_recording", config.require_recording);
  table.Optional("recording_timeout_s", config.recording_timeout_s, 0.6, 600);
  RETURN_IF_ERROR(table.Finish());
  RETURN_IF_ERROR(config.Check());
  return config;
}

}  // namespace forgescan
