// Everything the report of one part tells, gathered: the JSON file and the page are two views of it.
#pragma once

#include <cstdint>
#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "services/report/history.h"
#include "services/report/trend.h"
#include "services/report/verdict_rule.h"

namespace forgescan {

inline constexpr double kNotKnown =
    std::numeric_limits<double>::quiet_NaN();  // null in JSON, a dash on the page

// As in registration_t.
struct ReportedRegistration {
  std::string status = "MISSING";  // CONVERGED, FAILED, NOT_INSPECTED, UNKNOWN; MISSING = no message came
  std::string reason;
  int iterations = 0;
  double rms_mm = kNotKnown;
  double inlier_share = kNotKnown;
  double foreign_share = kNotKnown;
  double shift_mm = kNotKnown;
  double turn_rad = kNotKnown;
  double weakest_eigenvalue = kNotKnown;
  std::vector<double> model_from_array;  // row-major 4x4, mm; empty unless converged
};

// As in fused_view_t.
struct ReportedView {
  int view = 0;
  std::string status;  // OK, VOID, UNKNOWN
  std::string reason;
  std::int64_t captured_utime = 0;
  double temperature_degc = kNotKnown;
  double scale = kNotKnown;
  int points = 0;
  double modulation_median_dn = kNotKnown;
  double consistency_rms_rad = kNotKnown;
};

// Seconds. Steps: sum over the views, by the clock of the service that did them.
struct ReportedTiming {
  double scan = kNotKnown;
  double reconstruction = kNotKnown;
  double fusion = kNotKnown;
  double registration = kNotKnown;
  double report = kNotKnown;                 // from the last message the verdict needed to the verdict
  double last_frame_to_verdict = kNotKnown;  // event time of the last view to the verdict
};

// Of this part alone; README.md says what each counts. Nothing = not known.
struct ReportedCounters {
  std::optional<std::int64_t> frames_expected;
  std::optional<std::int64_t> frames_used;
  std::optional<std::int64_t> frames_lost;
  std::optional<std::int64_t> messages_missing;
  std::optional<std::int64_t> restarts;
};

// How one dimension moved over the last parts, this one included.
struct ReportedTrend {
  std::string name;
  std::vector<HistoryPoint> points;  // oldest first
  std::optional<Trend> trend;        // nothing when there are too few measured values
  std::optional<int> parts_to_limit;
};

struct PartReport {
  std::string station;
  std::string software_version;
  std::string config_hash;
  int part = 0;
  std::int64_t arrived_utime = 0;    // us since 1970 UTC; 0 = not known
  std::int64_t last_view_utime = 0;  // us since 1970 UTC; 0 = not known
  std::int64_t verdict_utime = 0;    // us since 1970 UTC
  PartVerdict verdict;
  double reference_degc = kNotKnown;  // to which all views were scaled
  std::vector<JudgedDimension> dimensions;
  ReportedRegistration registration;
  std::vector<ReportedView> views;
  ReportedTiming timing_s;
  ReportedCounters counters;
  std::vector<ReportedTrend> trends;            // on the page only
  std::vector<std::uint8_t> deviation_picture;  // PNG, on the page only; empty = none
};

}  // namespace forgescan
