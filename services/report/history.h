// Every judged part of a station, for good: one SQLite file, only ever appended to.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "services/common/result.h"
#include "services/report/verdict_rule.h"

namespace forgescan {

struct PartRecord {
  int part = 0;
  std::int64_t utime = 0;  // us since 1970 UTC, of the last view
  Verdict verdict = Verdict::kUnknown;
  std::string reason;
  std::string report_folder;
  std::vector<JudgedDimension> dimensions;
};

// One value of a dimension, oldest first in what Last() returns.
struct HistoryPoint {
  std::int64_t part_index = 0;  // 1, 2, 3, ... in the order of judgement, over all parts
  int part = 0;                 // number counted by the line; may start again
  std::int64_t utime = 0;
  double nominal_mm = 0.0;
  double measured_mm = 0.0;  // NaN when not determined
  double lower_mm = 0.0;
  double upper_mm = 0.0;
  double uncertainty_mm = 0.0;  // NaN when not determined
  double temperature_degc = 0.0;
  Verdict verdict = Verdict::kUnknown;
};

class History {
 public:
  // Opens or makes the file. Errors: kIo (not to be opened or written), kFormat (not a database of ours,
  // damaged, or of another version of the schema).
  static Result<History> Open(const std::string& path);
  History(History&&) noexcept;
  History& operator=(History&&) noexcept;
  ~History();

  // All of the part or nothing of it. Errors: kInvalidArgument (this part and utime are in already), kIo
  // (disk full, ...).
  Status Append(const PartRecord& record);
  // The last `count` parts, newest first, without their dimensions.
  Result<std::vector<PartRecord>> LastParts(int count) const;
  // The dimension's values on the last `count` parts that have it, oldest first.
  Result<std::vector<HistoryPoint>> LastValues(const std::string& dimension, int count) const;

 private:
  struct Database;
  explicit History(std::unique_ptr<Database> database);
  std::unique_ptr<Database> database_;
};

}  // namespace forgescan
