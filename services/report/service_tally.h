// What the services say they have lost, and how often they were started anew. Pure: the caller gives the
// time.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "fsmsg/service_state_t.hpp"

namespace forgescan {

// Sums over all services. The difference of two is what happened between them.
struct ServiceSums {
  std::int64_t messages_missing = 0;  // given up, since each service was first heard
  std::int64_t restarts = 0;          // sessions beyond the first heard of each service
};

class ServiceTally {
 public:
  // expected: names of the services that must have been heard before anything can be said of all.
  explicit ServiceTally(std::vector<std::string> expected) : expected_(std::move(expected)) {}
  // now_us: when the state arrived, by the clock that HeardSince() is asked in. States may come late or
  // twice.
  void Note(const fsmsg::service_state_t& state, std::int64_t now_us);

  // Nothing until every expected service has been heard.
  std::optional<ServiceSums> Sums() const;
  // Every service ever heard has been heard since then, or its last word was that it stops.
  bool HeardSince(std::int64_t since_us) const;

 private:
  struct Service {
    std::map<std::int64_t, std::int64_t> missing;  // by session
    std::int64_t missing_before = 0;               // what it had given up when first heard
    std::int64_t heard_us = 0;
    bool stopping = false;
  };
  std::vector<std::string> expected_;
  std::map<std::string, Service> services_;  // by name
};

}  // namespace forgescan
