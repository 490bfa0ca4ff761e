// report.html: the report of one part for people; one file, nothing outside of it, no scripts.
#pragma once

#include <span>
#include <string>

#include "services/report/part_report.h"

namespace forgescan {

// Equal reports give equal bytes. All text is escaped; numbers are those of ReportJson, rounded to what is
// readable.
std::string ReportHtml(const PartReport& report);

// index.html of the results folder: the last parts, newest first, each with a link to its page.
std::string IndexHtml(const std::string& station, std::span<const PartRecord> parts);

}  // namespace forgescan
