// What has come of one part so far, and whether that is enough for a verdict.
#pragma once

#include <cstdint>
#include <limits>
#include <map>
#include <optional>
#include <string>

#include "fsmsg/fusion_result_t.hpp"
#include "fsmsg/part_arrived_t.hpp"
#include "fsmsg/registration_t.hpp"
#include "fsmsg/scan_complete_t.hpp"
#include "fsmsg/verdict_t.hpp"
#include "services/common/geometry/point_cloud.h"
#include "services/report/part_report.h"
#include "services/report/service_tally.h"

namespace forgescan {

struct PartInWork {
  int part = 0;
  std::int64_t first_utime = 0;  // us since 1970 UTC, of the earliest event known of the part
  std::int64_t ignore_before_utime = std::numeric_limits<std::int64_t>::min();  // older is of an earlier part
  // us since 1970 UTC; results with another end of the scan are of another part with the number.
  std::optional<std::int64_t> scan_end_utime;
  std::string stopped;  // why nothing is measured, whatever is here; empty = nothing against it
  std::optional<fsmsg::part_arrived_t> arrived;
  std::optional<fsmsg::scan_complete_t> scan;
  std::optional<fsmsg::fusion_result_t> fusion;
  std::optional<fsmsg::registration_t> registration;
  std::int64_t registration_us = 0;  // when it arrived
  std::optional<PointCloud> cloud_in_model;
  std::string cloud_error;  // why the cloud cannot be used; empty = nothing wrong so far
  std::map<std::string, std::int64_t> duration_us;  // by step, summed over the views
  std::optional<ServiceSums> sums_at_opening;
  bool fusion_hole = false;  // results of the fusion were given up meanwhile, of this part or of others
  bool cloud_hole = false;   // slices of registered clouds were

  bool converged() const;
  // The cloud is here, or there is none to wait for.
  bool CloudSettled() const;
  // Everything a verdict needs, and the fusion's word on the views, is here.
  bool Complete() const;
  // Why the part cannot be measured from what is here, one sentence; empty if it can.
  std::string Obstacle() const;
  // us since 1970 UTC, of the end of the scan; of the earliest event where that is not known. Never the time
  // of arrival at this service, so that a replay gives the same.
  std::int64_t EventUtime() const { return scan_end_utime.value_or(first_utime); }
  // An event of this time lies within the part's scan, as far as it is known.
  bool Covers(std::int64_t utime) const;
};

// The part of the report that is a copy of the messages: registration, views, frames, times of the part.
PartReport ReportOf(const PartInWork& work);
// The timing with the steps that messages told of so far.
ReportedTiming WithSteps(ReportedTiming timing_s, const PartInWork& work);
fsmsg::verdict_t VerdictMessage(const PartReport& report, std::int64_t utime,
                                const std::string& report_folder);

}  // namespace forgescan
