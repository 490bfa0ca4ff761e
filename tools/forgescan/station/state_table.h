// The live table of a station: what every service says of itself, and how long ago.
#pragma once

#include <map>
#include <string>

#include "fsmsg/service_state_t.hpp"
#include "services/common/bus/bus.h"

namespace forgescan {

class StateTable {
 public:
  // Listens on the bus from now on.
  explicit StateTable(Bus& bus);

  const std::map<std::string, fsmsg::service_state_t>& states() const { return states_; }
  // True if every one of the services has been heard and is ready or working.
  bool AllReady(const std::vector<std::string>& services) const;
  // The table as text for a terminal: one line a service, `width` columns, with colours if asked for.
  std::string Render(const std::vector<std::string>& services, int width, bool colour) const;

 private:
  Bus& bus_;
  std::map<std::string, fsmsg::service_state_t> states_;  // newest of each service
};

}  // namespace forgescan
