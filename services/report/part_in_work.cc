#include "services/report/part_in_work.h"

#include <fmt/format.h>

#include <algorithm>

#include "fsmsg/view_result_t.hpp"

namespace forgescan {
namespace {

constexpr double kSecondsPerUs = 1e-6;

std::string RegistrationStatus(std::int8_t status) {
  switch (status) {
    case fsmsg::registration_t::STATUS_CONVERGED:
      return "CONVERGED";
    case fsmsg::registration_t::STATUS_FAILED:
      return "FAILED";
    case fsmsg::registration_t::STATUS_NOT_INSPECTED:
      return "NOT_INSPECTED";
    default:
      return "UNKNOWN";
  }
}

std::string ViewStatus(std::int8_t status) {
  switch (status) {
    case fsmsg::view_result_t::STATUS_OK:
      return "OK";
    case fsmsg::view_result_t::STATUS_VOID:
      return "VOID";
    default:
      return "UNKNOWN";
  }
}

ReportedRegistration Reported(const fsmsg::registration_t& from, bool converged) {
  ReportedRegistration to{RegistrationStatus(from.status),
                          from.reason,
                          from.iterations,
                          from.rms_mm,
                          from.inlier_share,
                          from.foreign_share,
                          from.shift_mm,
                          from.turn_rad,
                          from.weakest_eigenvalue,
                          {}};
  if (converged) {
    to.model_from_array.assign(std::begin(from.model_from_array), std::end(from.model_from_array));
  }
  return to;
}

ReportedView Reported(const fsmsg::fused_view_t& from) {
  return {from.view,           ViewStatus(from.status),   from.reason,
          from.captured_utime, from.temperature_degc,     from.scale,
          from.points,         from.modulation_median_dn, from.consistency_rms_rad};
}

// What a part that ends too early was waiting for.
std::string MissingSentence(const PartInWork& work) {
  if (work.registration.has_value()) {
    return "The registered points did not arrive whole.";
  }
  if (work.fusion.has_value()) {
    return "The result of the registration did not arrive in time.";
  }
  if (work.scan.has_value()) {
    return fmt::format("The result of the fusion did not arrive in time; {} of {} views were captured.",
                       work.scan->views_captured, work.scan->views_expected);
  }
  return "The scan of the part was not completed in time.";
}

fsmsg::dimension_t Message(const JudgedDimension& from) {
  fsmsg::dimension_t to{};
  to.name = from.name;
  to.nominal_mm = from.nominal_mm;
  to.measured_mm = from.measured_mm;
  to.deviation_mm = from.deviation_mm;
  to.lower_mm = from.lower_mm;
  to.upper_mm = from.upper_mm;
  to.uncertainty_mm = from.uncertainty_mm;
  to.temperature_degc = from.temperature_degc;
  to.points = from.points;
  to.rejected_share = from.rejected_share;
  to.verdict = static_cast<std::int8_t>(from.verdict);
  to.reason = from.reason;
  return to;
}

}  // namespace

bool PartInWork::converged() const {
  return registration.has_value() && registration->status == fsmsg::registration_t::STATUS_CONVERGED;
}

bool PartInWork::CloudSettled() const {
  return registration.has_value() && (!converged() || cloud_in_model.has_value() || !cloud_error.empty());
}

bool PartInWork::Complete() const { return fusion.has_value() && CloudSettled(); }

std::string PartInWork::Obstacle() const {
  if (!stopped.empty()) {
    return stopped;
  }
  if (registration.has_value() && !converged()) {
    return registration->reason.empty()
               ? fmt::format("The registration ended with status {} and gave no reason.",
                             RegistrationStatus(registration->status))
               : registration->reason;
  }
  if (!cloud_error.empty()) {
    return cloud_error;
  }
  if (!registration.has_value() || !cloud_in_model.has_value()) {
    return MissingSentence(*this);
  }
  if (cloud_in_model->size() != static_cast<std::size_t>(registration->points)) {
    return fmt::format("The registration announced {} points, {} arrived.", registration->points,
                       cloud_in_model->size());
  }
  return "";
}

bool PartInWork::Covers(std::int64_t utime) const {
  const std::int64_t start_utime = scan.has_value()     ? scan->scan_start_utime
                                   : fusion.has_value() ? fusion->scan_start_utime
                                                        : first_utime;
  return utime >= std::min(start_utime, first_utime) && utime <= EventUtime();
}

PartReport ReportOf(const PartInWork& work) {
  PartReport report;
  report.part = work.part;
  report.arrived_utime = work.arrived.has_value() ? work.arrived->utime : 0;
  report.last_view_utime = work.scan_end_utime.value_or(0);
  if (work.registration.has_value()) {
    report.registration = Reported(*work.registration, work.converged());
    report.reference_degc = work.registration->reference_degc;
  }
  if (work.fusion.has_value()) {
    for (const fsmsg::fused_view_t& view : work.fusion->views) {
      report.views.push_back(Reported(view));
    }
    report.counters.frames_expected = work.fusion->frames_expected;
    report.counters.frames_used = work.fusion->frames_used;
    report.counters.frames_lost = work.fusion->frames_expected - work.fusion->frames_used;
    report.reference_degc = work.fusion->reference_degc;
  }
  report.timing_s = WithSteps({}, work);
  return report;
}

ReportedTiming WithSteps(ReportedTiming timing_s, const PartInWork& work) {
  const auto step = [&work](const char* name) {
    const auto found = work.duration_us.find(name);
    return found == work.duration_us.end() ? kNotKnown : static_cast<double>(found->second) * kSecondsPerUs;
  };
  timing_s.reconstruction = step("reconstruction");
  timing_s.fusion = step("fusion");
  timing_s.registration = step("registration");
  if (work.scan.has_value()) {
    timing_s.scan = static_cast<double>(work.scan->utime - work.scan->scan_start_utime) * kSecondsPerUs;
  } else if (work.fusion.has_value() && work.fusion->scan_start_utime > 0) {
    timing_s.scan = static_cast<double>(work.fusion->utime - work.fusion->scan_start_utime) * kSecondsPerUs;
  }
  return timing_s;
}

fsmsg::verdict_t VerdictMessage(const PartReport& report, std::int64_t utime,
                                const std::string& report_folder) {
  fsmsg::verdict_t message{};
  message.utime = utime;
  message.part = report.part;
  message.verdict = static_cast<std::int8_t>(report.verdict.verdict);
  message.reason = report.verdict.reason;
  message.report_folder = report_folder;
  for (const JudgedDimension& dimension : report.dimensions) {
    message.dimensions.push_back(Message(dimension));
  }
  message.dimension_count = static_cast<std::int32_t>(message.dimensions.size());
  return message;
}

}  // namespace forgescan
