// What the services of a replay hear of each other when a change is carried on through the chain: each result
// of the replay in the place of the recorded one. A replay computes in no time, so a result is there before
// its place; a service that was killed meanwhile must not hear it.
#pragma once

#include <deque>
#include <map>
#include <optional>
#include <string>
#include <utility>

#include "tools/forgescan/replay/result_comparison.h"

namespace forgescan {

class ChainedResults {
 public:
  // `recorded` outlives this.
  explicit ChainedResults(const ResultComparison& recorded) : recorded_(recorded) {}

  bool Holds(const std::string& channel) const { return recorded_.channels().contains(channel); }
  // A result of the replay. Errors: kFormat (no stream's message).
  Status Add(const std::string& channel, ByteView result);
  // The place of a recorded result whose event was then.
  void Pass(const std::string& channel, std::int64_t utime);
  // A result whose turn has come, with its channel. One that has no place in the record comes at once, or
  // with the last of its event and channel.
  std::optional<std::pair<std::string, Bytes>> Take();

 private:
  struct Moment {
    std::deque<Bytes> made;  // waiting for their place
    std::size_t passed = 0;  // places
    std::size_t taken = 0;   // results
  };
  void MoveWhatIsDue(const std::string& channel, std::int64_t utime);

  const ResultComparison& recorded_;
  std::map<std::pair<std::string, std::int64_t>, Moment> moments_;  // by channel and event
  std::deque<std::pair<std::string, Bytes>> due_;
};

}  // namespace forgescan
