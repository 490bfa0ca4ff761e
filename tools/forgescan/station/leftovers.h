// Services whose supervisor was killed. They are asked to end when it dies (PR_SET_PDEATHSIG), but one that
// hangs does not: a second robot service on the CAN bus, unless it is ended before the station starts again.
#pragma once

#include "services/common/result.h"
#include "tools/forgescan/station/station_lock.h"
#include "tools/forgescan/station/supervision_policy.h"
#include "tools/forgescan/station/supervisor_log.h"

namespace forgescan {

// Waits for those that still run, each for as long as it may take to stop, and kills them then. Errors:
// kUnavailable (one cannot be ended).
Status EndLeftovers(const ServiceProcesses& left_behind, const SupervisionPolicy& policy, SupervisorLog& log);

}  // namespace forgescan
