// The small drawings of the report page, as inline SVG. Colours and shapes of verdicts are the same in all of
// them.
#pragma once

#include <string>

#include "services/report/part_report.h"

namespace forgescan {

// "ok", "not-ok", "not-decidable", "not-inspected": class names that the page's style sheet colours.
std::string VerdictClass(Verdict verdict);
// "OK", "Not OK", "Not decidable", "Not inspected".
std::string VerdictLabel(Verdict verdict);

// Where the measured size lies within its limits: limits as ticks, guard bands of width U, the value with its
// +-U.
std::string LimitsChart(const JudgedDimension& dimension);

// The last parts of one dimension with limits, trend line when significant, the newest part ringed.
std::string TrendChart(const ReportedTrend& trend);
// What the trend says, one line.
std::string TrendSentence(const ReportedTrend& trend);

}  // namespace forgescan
