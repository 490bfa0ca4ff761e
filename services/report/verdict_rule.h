// The decision rule: what a measured size, its limits and its uncertainty allow to be said of a dimension and
// of a part.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "services/report/uncertainty.h"

namespace forgescan {

// Same numbers as verdict_t.VERDICT_*.
enum class Verdict : std::int8_t { kUnknown = 0, kOk = 1, kNotOk = 2, kNotDecidable = 3, kNotInspected = 4 };

// "OK", "NOT_OK", "NOT_DECIDABLE", "NOT_INSPECTED", "UNKNOWN".
std::string_view VerdictText(Verdict verdict);
// The verdict with that number, kUnknown for any other number: it comes from a wire or a file.
Verdict VerdictFromNumber(std::int64_t number);

struct JudgedDimension {
  std::string name;
  double nominal_mm = 0.0;
  double measured_mm = 0.0;   // NaN when not determined
  double deviation_mm = 0.0;  // measured - nominal; NaN when not determined
  double lower_mm = 0.0;      // limits of the size
  double upper_mm = 0.0;
  std::string definition;                          // what was measured; empty when not determined
  double uncertainty_mm = 0.0;                     // expanded, k = 2; NaN when not determined
  std::vector<UncertaintyTerm> uncertainty_terms;  // its contributions; empty where U was stated
  double temperature_degc = 0.0;  // for which the size and its limits hold; NaN when not known
  int points = 0;                 // used
  double rejected_share = 0.0;    // of the points of the feature, 0..1
  Verdict verdict = Verdict::kUnknown;
  std::string reason;  // why there is no measured value, or what speaks against it; else empty
};

// Verdict on one size. Source: ISO 14253-1 with the expanded uncertainty U as guard band: OK if lower + U <=
// y <= upper - U, NOT_OK if y < lower - U or y > upper + U, NOT_DECIDABLE between. A tolerance narrower than
// 2 U can never be OK. Units: mm. A measured value, uncertainty or limit that is not finite, or U < 0, or
// lower > upper: NOT_INSPECTED.
Verdict JudgeSize(double measured_mm, double uncertainty_mm, double lower_mm, double upper_mm);

struct PartVerdict {
  Verdict verdict = Verdict::kUnknown;
  std::string reason;  // one sentence that names the dimensions; empty when OK
};

// The worst that can be said with certainty goes first: NOT_OK, NOT_INSPECTED, NOT_DECIDABLE, OK.
// A part without any dimension is NOT_INSPECTED: nothing was shown to be right.
PartVerdict JudgePart(std::span<const JudgedDimension> dimensions);

}  // namespace forgescan
