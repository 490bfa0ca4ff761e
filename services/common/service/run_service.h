// What the main.cc of every service shares: arguments, station file, bus, state, signals, exit code.
#pragma once

#include <functional>
#include <memory>
#include <string>

#include "services/common/bus/lcm_bus.h"
#include "services/common/service/service_parts.h"

namespace forgescan {

struct ServiceContext : ServiceParts {
  LcmBus& bus;
  // Called at SIGINT or SIGTERM. Stops the bus unless the factory puts something in its place that does so
  // before long: a service that has work to end first.
  std::function<void()>& stop;
};

// Makes the service on its concrete drivers; what it returns lives until the service stops.
using ServiceFactory = std::function<Result<std::shared_ptr<void>>(const ServiceContext&)>;

// forgescan-NAME --station FOLDER. Runs until SIGINT or SIGTERM. Returns the exit code: 0 stopped on request,
// 1 otherwise, with one sentence on stderr.
int RunService(const std::string& name, int argc, char** argv, const ServiceFactory& factory);

}  // namespace forgescan
