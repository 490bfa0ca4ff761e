#include "services/report/report_pages.h"

#include <utility>

namespace forgescan {
namespace {

constexpr std::int64_t kAskAgainUs = 100'000;
constexpr std::int64_t kServicesPatienceUs = 5'000'000;  // each says its state once a second; some get lost

}  // namespace

ReportPages::ReportPages(Bus& bus, ServiceMonitor& monitor, std::string station_name, Means means)
    : bus_(bus), monitor_(monitor), station_name_(std::move(station_name)), means_(means) {}

ReportPages::~ReportPages() {
  while (!due_.empty()) {
    Write(due_.begin()->first);
  }
}

void ReportPages::Add(JudgedPart judged) {
  const int part = judged.report.part;
  if (due_.contains(part)) {
    Write(part);
  }
  const auto delay_us = static_cast<std::int64_t>(means_.config.page_delay_s * 1e6);
  const Bus::TimerId timer =
      bus_.At(judged.report.verdict_utime + delay_us, [this, part] { WriteWhenAllAreHeard(part); });
  due_[part] = {std::move(judged), timer};
}

PartInWork* ReportPages::Find(int part) {
  const auto found = due_.find(part);
  return found == due_.end() ? nullptr : &found->second.judged.work;
}

// States that wait in the socket while a part is measured are older than its verdict: only what comes after
// the delay counts as a word on it.
void ReportPages::WriteWhenAllAreHeard(int part) {
  Due& due = due_.at(part);
  const std::int64_t delayed_us =
      due.judged.report.verdict_utime + static_cast<std::int64_t>(means_.config.page_delay_s * 1e6);
  if (means_.tally.HeardSince(delayed_us) || bus_.NowUs() >= delayed_us + kServicesPatienceUs) {
    Write(part);
  } else {
    due.timer = bus_.At(bus_.NowUs() + kAskAgainUs, [this, part] { WriteWhenAllAreHeard(part); });
  }
}

void ReportPages::Complete(JudgedPart& judged) {
  PartReport& report = judged.report;
  report.timing_s = WithSteps(report.timing_s, judged.work);
  const std::optional<ServiceSums> now = means_.tally.Sums(), before = judged.work.sums_at_opening;
  if (means_.tally.HeardSince(report.verdict_utime) && before.has_value() && now.has_value()) {
    report.counters.messages_missing = now->messages_missing - before->messages_missing;
    report.counters.restarts = now->restarts - before->restarts;
  }
  if (Result<std::vector<ReportedTrend>> trends = means_.writer.Trends(report); trends.ok()) {
    report.trends = std::move(*trends);
  } else {
    Note(trends.error());
  }
  if (judged.work.converged() && judged.work.cloud_in_model.has_value()) {
    Result<std::vector<std::uint8_t>> picture =
        PictureOf(*judged.work.cloud_in_model, means_.evaluator, means_.config);
    if (picture.ok()) {
      report.deviation_picture = std::move(*picture);
    } else {
      Note(picture.error());
    }
  }
}

void ReportPages::Write(int part) {
  Due due = std::move(due_.extract(part).mapped());
  bus_.Cancel(due.timer);
  Complete(due.judged);
  Note(means_.writer.WriteJson(due.judged.report, due.judged.folder_name));
  Note(means_.writer.WritePage(due.judged.report, due.judged.folder_name));
  Note(means_.writer.WriteIndex(station_name_));
}

void ReportPages::Note(const Status& status) {
  if (!status.ok()) {
    monitor_.ReportError(status.error());
  }
}

}  // namespace forgescan
