#include "services/report/report_json.h"

#include <cmath>
#include <nlohmann/json.hpp>

#include "services/report/report_text.h"

namespace forgescan {
namespace {

using Json = nlohmann::ordered_json;

Json Number(double value) { return std::isfinite(value) ? Json(value) : Json(nullptr); }
Json Count(const std::optional<std::int64_t>& value) {
  return value.has_value() ? Json(*value) : Json(nullptr);
}
Json Time(std::int64_t utime) { return utime > 0 ? Json(utime) : Json(nullptr); }

// Standard uncertainties, by what they come from; their root of squares times 2 is uncertainty_mm.
Json Contributions(const std::vector<UncertaintyTerm>& terms) {
  Json list = Json::array();
  for (const UncertaintyTerm& term : terms) {
    list.push_back({{"name", term.name}, {"standard_mm", Number(term.standard_mm)}});
  }
  return list;
}

Json Dimension(const JudgedDimension& from) {
  return {{"name", from.name},
          {"nominal_mm", Number(from.nominal_mm)},
          {"measured_mm", Number(from.measured_mm)},
          {"deviation_mm", Number(from.deviation_mm)},
          {"lower_mm", Number(from.lower_mm)},
          {"upper_mm", Number(from.upper_mm)},
          {"temperature_degc", Number(from.temperature_degc)},
          {"verdict", VerdictText(from.verdict)},
          {"uncertainty_mm", Number(from.uncertainty_mm)},
          {"definition", from.definition},
          {"uncertainty_contributions", Contributions(from.uncertainty_terms)},
          {"points", from.points},
          {"rejected_share", Number(from.rejected_share)},
          {"reason", from.reason}};
}

Json Registration(const ReportedRegistration& from) {
  Json matrix = nullptr;
  if (!from.model_from_array.empty()) {
    matrix = Json::array();
    for (const double value : from.model_from_array) {
      matrix.push_back(Number(value));
    }
  }
  return {{"status", from.status},
          {"reason", from.reason},
          {"iterations", from.iterations},
          {"rms_mm", Number(from.rms_mm)},
          {"inlier_share", Number(from.inlier_share)},
          {"foreign_share", Number(from.foreign_share)},
          {"shift_mm", Number(from.shift_mm)},
          {"turn_rad", Number(from.turn_rad)},
          {"weakest_eigenvalue", Number(from.weakest_eigenvalue)},
          {"model_from_array", std::move(matrix)}};
}

Json View(const ReportedView& from) {
  return {{"view", from.view},
          {"status", from.status},
          {"reason", from.reason},
          {"captured_utime", Time(from.captured_utime)},
          {"temperature_degc", Number(from.temperature_degc)},
          {"scale", Number(from.scale)},
          {"points", from.points},
          {"modulation_median_dn", Number(from.modulation_median_dn)},
          {"consistency_rms_rad", Number(from.consistency_rms_rad)}};
}

Json Timing(const ReportedTiming& from) {
  return {{"scan", Number(from.scan)},     {"reconstruction", Number(from.reconstruction)},
          {"fusion", Number(from.fusion)}, {"registration", Number(from.registration)},
          {"report", Number(from.report)}, {"last_frame_to_verdict", Number(from.last_frame_to_verdict)}};
}

Json Counters(const ReportedCounters& from) {
  return {{"frames_expected", Count(from.frames_expected)},
          {"frames_used", Count(from.frames_used)},
          {"frames_lost", Count(from.frames_lost)},
          {"messages_missing", Count(from.messages_missing)},
          {"restarts", Count(from.restarts)}};
}

template <typename Item, typename Write>
Json List(const std::vector<Item>& items, Write write) {
  Json list = Json::array();
  for (const Item& item : items) {
    list.push_back(write(item));
  }
  return list;
}

}  // namespace

std::string ReportJson(const PartReport& report) {
  const Json json = {{"part", report.part},
                     {"verdict", VerdictText(report.verdict.verdict)},
                     {"reason", report.verdict.reason},
                     {"station", report.station},
                     {"software_version", report.software_version},
                     {"config_hash", report.config_hash},
                     {"arrived_utime", Time(report.arrived_utime)},
                     {"last_view_utime", Time(report.last_view_utime)},
                     {"verdict_utime", Time(report.verdict_utime)},
                     {"verdict_time", UtcText(report.verdict_utime)},
                     {"reference_degc", Number(report.reference_degc)},
                     {"dimensions", List(report.dimensions, Dimension)},
                     {"registration", Registration(report.registration)},
                     {"views", List(report.views, View)},
                     {"timing_s", Timing(report.timing_s)},
                     {"counters", Counters(report.counters)}};
  return json.dump(2, ' ', false, Json::error_handler_t::replace) + "\n";
}

}  // namespace forgescan
