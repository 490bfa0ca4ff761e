// Settings of the robot service; the only home of their defaults.
#pragma once

#include "services/common/config/config.h"

namespace forgescan {

struct RobotConfig {
  int path = 1;                 // number of the taught path
  std::int64_t path_crc32 = 0;  // of the path the view matrices were taught on; 0: not checked
  bool require_warm = true;  // no inspection with a cold robot: its repeatability is not that of the teaching
  int echo_timeout_ms = 50;
  int resends = 2;
  int max_attempts = 2;          // of a view, the first included
  double capture_timeout_s = 6;  // from view ready to view captured
  double home_timeout_s = 15;
  int sort_echo_timeout_ms = 100;
  int sort_resends = 3;
  double gate_timeout_s = 3;
  double cooling_timeout_s =
      5;  // without a cooling state for so long, or from the start, no part is inspected; 0: not watched
  bool require_recording = false;  // no part without the recorder
  double recording_timeout_s = 3;  // without a state of the recorder for so long; watched if required

  // Errors: kInvalidArgument, naming the field and its range.
  Status Check() const;
  // Reads the table [robot].
  static Result<RobotConfig> Load(ConfigTable table);
};

}  // namespace forgescan
