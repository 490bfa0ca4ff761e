// The services that can be computed again from a recording: those whose every input travels on the bus. What
// trigger, cameras, robot and cooling say comes from hardware; it is input here.
#pragma once

#include <memory>
#include <span>
#include <string>
#include <vector>

#include "services/common/service/service_parts.h"

namespace forgescan {

struct ReplayableService {
  const char* name;                    // as in its SERVICE_STATE
  std::vector<const char*> results;    // channels on which it sends what replay compares
  std::vector<const char*> durations;  // channels on which it sends wall-clock durations: never compared
  Result<std::shared_ptr<void>> (*make)(const ServiceParts& parts);
  bool keeps_files = false;  // writes to the results folder, and reads there when it starts
};

// In the order of the chain.
std::span<const ReplayableService> ReplayableServices();

// Those with the names, in the order of the chain; all if there are no names. Errors: kInvalidArgument (a
// name that is none).
Result<std::vector<ReplayableService>> SelectServices(const std::vector<std::string>& names);

}  // namespace forgescan
