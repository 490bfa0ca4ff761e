// The live table of a station: what every service says of itself, how long ago, and what its process costs.
#pragma once

#include <deque>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "fsmsg/service_state_t.hpp"
#include "services/common/bus/bus.h"
#include "tools/forgescan/station/process_usage.h"

namespace forgescan {

// What only the supervisor knows of a service.
struct TableRow {
  std::string service;
  std::optional<Usage> usage;   // nothing: no process, or not known here
  std::optional<int> restarts;  // nothing: not known here
  bool given_up = false;
};

class StateTable {
 public:
  // Listens on the bus from now on.
  explicit StateTable(Bus& bus);

  const std::map<std::string, fsmsg::service_state_t>& states() const { return states_; }
  // True if every one of the services has been heard lately and is ready or working.
  bool AllReady(const std::vector<std::string>& services) const;
  // The table as text for a terminal: one line a service, at most `width` columns (at least 96), then the
  // last errors; with colours if asked for. What is not known is "-".
  std::string Render(const std::vector<TableRow>& rows, int width, bool colour) const;
  // The same as JSON: an object with one member a service; what is not known is null.
  std::string Json(const std::vector<TableRow>& rows) const;

 private:
  struct Rates {
    std::optional<double> in_per_s, out_per_s;  // messages of streams
  };
  struct Sums {
    std::int64_t utime = 0, in = 0, out = 0;
  };
  void OnState(const fsmsg::service_state_t& state);
  bool Silent(const fsmsg::service_state_t& state) const;
  std::int64_t AgeUs(const fsmsg::service_state_t& state) const { return bus_.NowUs() - state.utime; }
  Rates RatesOf(const std::string& service) const;
  std::string Line(const TableRow& row, std::size_t rest, bool colour) const;

  Bus& bus_;
  std::map<std::string, fsmsg::service_state_t> states_;  // newest of each service
  std::map<std::string, std::deque<std::int64_t>> left_;  // sessions it has ended, the last ones
  std::map<std::string, std::deque<Sums>> sums_;          // of some seconds
};

}  // namespace forgescan
