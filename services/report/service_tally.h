// What all services together say they have lost, and how often they were started anew.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <utility>

#include "fsmsg/service_state_t.hpp"

namespace forgescan {

class ServiceTally {
 public:
  void Note(const fsmsg::service_state_t& state) {
    missing_[{state.name, state.session}] = state.messages_missing;
  }

  // Given up by any service in any of its sessions seen.
  std::int64_t messages_missing() const;
  // Sessions seen beyond the first of each service.
  std::int64_t restarts() const;

 private:
  std::map<std::pair<std::string, std::int64_t>, std::int64_t> missing_;  // by name and session
};

}  // namespace forgescan
