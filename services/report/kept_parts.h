// What the report service must still know when it is started again: the parts that have no verdict yet, and
// the verdicts the line has not answered. A small file, written whole at every change.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "fsmsg/verdict_t.hpp"
#include "services/common/aged_map.h"
#include "services/common/result.h"

namespace forgescan {

struct KeptPart {
  std::int64_t first_utime = 0;               // us since 1970 UTC, of the earliest event known
  std::optional<std::int64_t> arrived_utime;  // us since 1970 UTC
  bool results_came = false;                  // some have been taken in, and are lost with the process
  std::optional<fsmsg::verdict_t> verdict;
};

class KeptParts {
 public:
  explicit KeptParts(std::string path) : path_(std::move(path)) {}

  // Takes up what the file of the process before holds; no file is nothing. Errors: kFormat, kIo; nothing is
  // taken up then.
  Status Recall();

  // Each writes the file if that changes anything. Errors: kIo.
  Status Begin(int part, std::int64_t first_utime);
  Status Arrived(int part, std::int64_t utime);
  Status ResultsCame(int part);
  Status Judged(const fsmsg::verdict_t& verdict);
  Status Sorted(int part);

  // action(part, kept), the oldest first.
  template <typename Action>
  void ForEach(Action action) {
    parts_.ForEach(action);
  }

 private:
  Status Write();

  std::string path_;
  AgedMap<int, KeptPart> parts_{16};  // more are not in the cell
};

}  // namespace forgescan
