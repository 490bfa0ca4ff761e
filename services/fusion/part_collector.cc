#include "services/fusion/part_collector.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace forgescan {

bool PartCollector::Admits(std::int64_t utime) {
  if (utime < ignore_before_utime_) {
    return false;
  }
  earliest_utime_ = std::min(earliest_utime_, utime);
  return true;
}

void PartCollector::OnViewResult(const fsmsg::view_result_t& result) {
  View& view = views_[result.view];
  if (!view.result.has_value() || result.attempt >= view.result->attempt) {
    view.result = result;
  }
}

std::optional<std::string> PartCollector::VoidReason(const View& view) const {
  if (view.void_reason.has_value()) {
    return view.void_reason;
  }
  if (view.result.has_value() && view.result->status != fsmsg::view_result_t::STATUS_OK) {
    return view.result->reason;
  }
  if (view.temperature.has_value() && view.temperature->valid != 1) {
    return "the pyrometer gave no part temperature";
  }
  if (view.result.has_value() && view.cloud.has_value() && view.cloud_utime == view.result->utime &&
      view.temperature.has_value()) {
    const bool whole = static_cast<std::size_t>(view.result->points) == view.cloud->size();
    if (!whole) return "the cloud is not the one the reconstruction announced";
    return view.taught_from_actual.ok() ? std::string() : view.taught_from_actual.error().message;
  }
  if (!view.result.has_value() && scan_->status != fsmsg::scan_complete_t::STATUS_COMPLETE &&
      AllCapturedHaveResults()) {
    return "not taken: " + scan_->reason;
  }
  return expired_;
}

bool PartCollector::AllCapturedHaveResults() const {
  const auto results = std::count_if(views_.begin(), views_.end(),
                                     [](const auto& view) { return view.second.result.has_value(); });
  return results >= scan_->views_captured;
}

bool PartCollector::Settled() const {
  if (!scan_.has_value() || (!arrived_.has_value() && !expired_.has_value())) {
    return false;
  }
  const View none;
  for (int k = 0; k < scan_->views_expected; ++k) {
    const auto found = views_.find(k);
    if (!VoidReason(found != views_.end() ? found->second : none).has_value()) {
      return false;
    }
  }
  return true;
}

PartCollector::Views PartCollector::TakeViews() {
  Views taken;
  taken.scan_utime = scan_->utime;
  for (int k = 0; k < scan_->views_expected; ++k) {
    View& view = views_[k];
    fsmsg::fused_view_t summary{};
    summary.view = k;
    summary.reason = VoidReason(view).value_or("still open");
    summary.temperature_degc = summary.scale = std::numeric_limits<double>::quiet_NaN();
    summary.status =
        summary.reason.empty() ? fsmsg::view_result_t::STATUS_OK : fsmsg::view_result_t::STATUS_VOID;
    if (view.result.has_value()) {
      summary.captured_utime = view.result->utime;
      summary.points = view.result->points;
      summary.modulation_median_dn = view.result->modulation_median_dn;
      summary.consistency_rms_rad = view.result->consistency_rms_rad;
      taken.frames_expected += view.result->frames_expected;
      taken.frames_used += view.result->frames_used;
    }
    if (summary.reason.empty()) {
      summary.temperature_degc = view.temperature->temperature_degc;
      taken.clouds.push_back({k, summary.temperature_degc, std::move(*view.cloud), *view.taught_from_actual});
    }
    taken.summary.push_back(summary);
  }
  return taken;
}

}  // namespace forgescan
