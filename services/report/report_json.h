// report.json: every number of a part's report, for programs.
#pragma once

#include <string>

#include "services/report/part_report.h"

namespace forgescan {

// UTF-8 text; members in a fixed order, equal reports give equal bytes. A number that is not known is null.
// Text that is not UTF-8 is written with the Unicode replacement character.
std::string ReportJson(const PartReport& report);

}  // namespace forgescan
