// What every service is made of: its station, its place on the bus, and where it says how it is.
#pragma once

#include "services/common/bus/stream_hub.h"
#include "services/common/service/service_monitor.h"
#include "services/common/service/station.h"

namespace forgescan {

// All outlive the service.
struct ServiceParts {
  const Station& station;
  StreamHub& hub;
  ServiceMonitor& monitor;
};

}  // namespace forgescan
