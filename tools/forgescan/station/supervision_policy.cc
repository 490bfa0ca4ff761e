#include "tools/forgescan/station/supervision_policy.h"

#include "services/recorder/recorder_config.h"

namespace forgescan {
namespace {

constexpr double kSlowDiskMbPerS = 50;

}  // namespace

double SupervisionPolicy::StopPatienceS(const std::string& service) const {
  return service == "recorder" ? recorder_stop_patience_s : stop_patience_s;
}

Result<SupervisionPolicy> SupervisionPolicy::Load(const ConfigFile& file) {
  SupervisionPolicy policy;
  ASSIGN_OR_RETURN(const RecorderConfig recorder, RecorderConfig::Load(file.Table("recorder")));
  ConfigTable table = file.Table("supervision");
  table.Optional("silence_s", policy.silence_s, 1.5, 3600.0);  // services speak once a second
  table.Optional("start_patience_s", policy.start_patience_s, 1.0, 3600.0);
  table.Optional("stage_patience_s", policy.stage_patience_s, 0.0, 600.0);
  table.Optional("restarts_max", policy.restarts_max, 0, 1000);
  table.Optional("restart_window_s", policy.restart_window_s, 1.0, 86'400.0);
  table.Optional("backoff_s", policy.backoff_s, 0.0, 600.0);
  table.Optional("backoff_max_s", policy.backoff_max_s, 0.0, 3600.0);
  table.Optional("keep_running", policy.keep_running);
  table.Optional("drain_s", policy.drain_s, 0.0, 600.0);
  table.Optional("stop_patience_s", policy.stop_patience_s, 0.1, 600.0);
  policy.recorder_stop_patience_s = policy.stop_patience_s + recorder.backlog_mb / kSlowDiskMbPerS;
  table.Optional("recorder_stop_patience_s", policy.recorder_stop_patience_s, 0.1, 3600.0);
  if (policy.backoff_max_s < policy.backoff_s) {
    table.Reject("backoff_max_s", "is less than backoff_s");
  }
  RETURN_IF_ERROR(table.Finish());
  return policy;
}

}  // namespace forgescan
