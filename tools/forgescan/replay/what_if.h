// What other settings would have changed: the verdicts of a session as recorded beside those of its replay.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "fsmsg/verdict_t.hpp"
#include "tools/forgescan/replay/recorded_session.h"

namespace forgescan {

struct DimensionChange {
  std::string name;
  double lower_mm, upper_mm;                  // limits now
  double recorded_mm, now_mm;                 // measured; NaN when not determined
  double recorded_u_mm, now_u_mm;             // expanded uncertainty; NaN when not determined
  std::int8_t recorded_verdict, now_verdict;  // verdict_t.VERDICT_*; UNKNOWN = not there

  bool Flipped() const { return recorded_verdict != now_verdict; }
};

struct PartChange {
  int part = 0;
  std::int64_t utime = 0;                             // of the verdict
  std::int8_t recorded_verdict = 0, now_verdict = 0;  // UNKNOWN = none
  std::string recorded_reason, now_reason;
  std::vector<DimensionChange> dimensions;

  bool Flipped() const { return recorded_verdict != now_verdict; }
};

// The recorded verdicts that are as they were sent. Errors: kIo.
Result<std::vector<fsmsg::verdict_t>> RecordedVerdicts(const RecordedSession& session);

// Parts in order of time; a part belongs together by number and utime. Dimensions in the features' order.
std::vector<PartChange> CompareVerdicts(const std::vector<fsmsg::verdict_t>& recorded,
                                        const std::vector<fsmsg::verdict_t>& now);

// For a terminal: one line a flip, then the largest change of every dimension.
std::string WhatIfText(const std::vector<PartChange>& parts);

struct WhatIfPage {
  std::string station;
  std::vector<std::string> recordings;
  std::vector<std::string> changes;  // of the settings, one line each
  std::vector<std::string> remarks;  // what is wrong with the recordings, one sentence each
};
// A page that needs nothing else.
std::string WhatIfHtml(const WhatIfPage& page, const std::vector<PartChange>& parts);

}  // namespace forgescan
