// Computes a recorded session again.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "tools/forgescan/replay/recorded_station.h"
#include "tools/forgescan/replay/replayable_services.h"
#include "tools/forgescan/replay/result_comparison.h"

namespace forgescan {

struct ReplayOptions {
  std::vector<ReplayableService> services;
  // Off: every service gets what the others sent when it was recorded. On: what they send now, so that a
  // change is carried on through the chain.
  bool chained = false;
  // Called now and then with the share that is done, 0..1.
  std::function<void(double)> on_progress = [](double) {};
  // Asked before every message; true ends the replay.
  std::function<bool()> interrupted = [] { return false; };
  // Every result of the services, in the order of the replay.
  std::function<void(const std::string& channel, ByteView message)> on_result = [](const std::string&,
                                                                                   ByteView) {};
};

struct ReplayOutcome {
  ResultComparison comparison;
  // Recorded messages, inputs and results, that are not as they were sent, one sentence each.
  std::vector<std::string> changed_inputs;
};

// Errors: those of the services' start, kIo (a recording cannot be read), kUnavailable (interrupted).
Result<ReplayOutcome> Replay(const RecordedSession& session, const Station& station,
                             const ReplayOptions& options);

}  // namespace forgescan
