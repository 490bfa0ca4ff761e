// What the robot service must still know of the last parts when it is started again: which were taken up,
// scanned, sorted. A small file, written whole at every change; it outlives the process, not the computer.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <utility>

#include "services/common/aged_map.h"
#include "services/common/result.h"

namespace forgescan {

struct RememberedPart {
  std::int64_t arrived_us = 0;  // us since 1970 UTC
  std::int32_t views = 0;
  std::int32_t captured = 0;
  bool scanned = false;  // the end of its scan was told
  bool sorted = false;   // the line was told where it belongs, or could not be
  bool asked = false;    // the line is being told; not kept in the file
};

class PartMemory {
 public:
  // Empty path: only in this process.
  explicit PartMemory(std::string path) : path_(std::move(path)) {}

  // Reads the file; none is none. Errors: kFormat, kIo; nothing is remembered then.
  Status Recall();

  // The youngest with its number; nothing if there is none.
  std::optional<std::pair<std::int32_t, RememberedPart>> Last();
  // Nothing if it is not remembered; holds until the next change.
  RememberedPart* Find(std::int32_t part) { return parts_.Find(part); }

  // Errors: kIo.
  Status Begin(std::int32_t part, const RememberedPart& remembered);
  Status Captured(std::int32_t part, std::int32_t captured);
  Status Scanned(std::int32_t part);
  Status Sorted(std::int32_t part);

 private:
  Status Write();

  std::string path_;
  AgedMap<std::int32_t, RememberedPart> parts_{16};  // more are not in the cell
};

}  // namespace forgescan
