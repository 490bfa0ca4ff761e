// When a service is taken for hung, how soon it is started again, and when the station gives it up.
#pragma once

#include <cstdint>
#include <string>

#include "services/common/config/config.h"

namespace forgescan {

struct SupervisionPolicy {
  double silence_s = 5;           // without a SERVICE_STATE: hung, killed and started again
  double start_patience_s = 30;   // the same for a service that has not said more than STARTING yet
  double stage_patience_s = 10;   // the next stage starts then, ready or not
  int restarts_max = 8;           // in the window; one more, and the service is given up
  double restart_window_s = 300;  // also: failures longer ago do not lengthen the wait for a restart
  double backoff_s = 1;           // before the second restart; doubled from one to the next
  double backoff_max_s = 30;
  bool keep_running = true;     // the rest of the station, when a service is given up
  double drain_s = 20;          // when the station stops: for the parts in work
  double stop_patience_s = 10;  // from SIGTERM to SIGKILL
  // The same for the recorder, which has to write what it has received. Without a key: stop_patience_s, and
  // the time a slow disk takes for [recorder] backlog_mb.
  double recorder_stop_patience_s = 40;

  double StopPatienceS(const std::string& service) const;

  // Reads the table [supervision]; every key is optional. Errors: as ConfigTable; the first wait longer than
  // the longest; as RecorderConfig::Load.
  static Result<SupervisionPolicy> Load(const ConfigFile& file);
};

}  // namespace forgescan
