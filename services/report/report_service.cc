#include "services/report/report_service.h"

#include <fmt/format.h>

#include <algorithm>

#include "services/common/bus/channels.h"
#include "services/report/judge_dimensions.h"

namespace forgescan {
namespace {

constexpr std::size_t kFinishedParts = 1000;  // a message later than that opens its part anew, and times out
constexpr double kUsPerSecond = 1e6;

// "parts_ok", "parts_not_ok", ...
std::string CounterName(Verdict verdict) {
  std::string name = "parts_" + std::string(VerdictText(verdict));
  std::transform(name.begin(), name.end(), name.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return name;
}

}  // namespace

Result<std::shared_ptr<ReportService>> ReportService::Create(StreamHub& hub, ServiceMonitor& monitor,
                                                             const ReportConfig& config,
                                                             const ReportStation& station,
                                                             const PartEvaluator& evaluator) {
  RETURN_IF_ERROR(config.Check());
  ASSIGN_OR_RETURN(ReportWriter writer, ReportWriter::Open(station.results_folder, config));
  return std::shared_ptr<ReportService>(
      new ReportService(hub, monitor, {config, station, std::move(writer)}, evaluator));
}

ReportService::ReportService(StreamHub& hub, ServiceMonitor& monitor, Parts parts,
                             const PartEvaluator& evaluator)
    : hub_(hub),
      monitor_(monitor),
      config_(parts.config),
      station_(std::move(parts.station)),
      writer_(std::move(parts.writer)),
      kept_(station_.results_folder + "/parts_in_work.txt"),
      evaluator_(evaluator),
      tally_(station_.services),
      pages_(hub.bus(), monitor, station_.name, {config_, writer_, evaluator_, tally_}),
      finished_(kFinishedParts) {
  Subscribe();
  SubscribeDurations();
  hub_.Advertise(kVerdict);
  Resume();
  TellState();
}

ReportService::~ReportService() {
  while (!open_.empty()) {
    const auto first = open_.begin();
    first->second.work.stopped = "The service was stopped before the part was judged.";
    GiveVerdict(first->first);
  }
  hub_.bus().Cancel(loss_timer_);
}

void ReportService::Subscribe() {
  hub_.Subscribe<fsmsg::part_arrived_t>(kPartArrived, [this](const auto& message) { OnArrived(message); });
  hub_.Subscribe<fsmsg::scan_complete_t>(kScanComplete, [this](const auto& message) {
    NoteScan(message.part, message.scan_start_utime, message.utime);
    if (PartInWork* work = FindScan(message.part, message.utime); work != nullptr) {
      work->scan = message;
    }
  });
  hub_.Subscribe<fsmsg::fusion_result_t>(kFusionResult, [this](const auto& message) {
    NoteScan(message.part, message.scan_start_utime, message.utime);
    if (PartInWork* work = FindScan(message.part, message.utime); work != nullptr) {
      work->fusion = message;
      Note(kept_.ResultsCame(message.part));
      FinishIfComplete(message.part);
    }
  });
  hub_.Subscribe<fsmsg::registration_t>(kRegistration, [this](const auto& message) {
    if (PartInWork* work = FindScan(message.part, message.utime); work != nullptr) {
      work->registration = message;
      work->registration_us = hub_.bus().NowUs();
      Note(kept_.ResultsCame(message.part));
      FinishIfComplete(message.part);
    }
  });
  hub_.Subscribe<fsmsg::cloud_slice_t>(kRegisteredCloud, [this](const auto& message) { OnSlice(message); });
  hub_.Subscribe<fsmsg::part_sorted_t>(kPartSorted, [this](const auto& message) { OnSorted(message); });
  hub_.OnLost(kRegisteredCloud, [this](std::int64_t, std::int64_t) { OnLoss(&PartInWork::cloud_hole); });
  hub_.OnLost(kFusionResult, [this](std::int64_t, std::int64_t) { OnLoss(&PartInWork::fusion_hole); });
}

void ReportService::SubscribeDurations() {
  const auto note = [this](const fsmsg::processing_time_t& message) { OnDuration(message); };
  hub_.Subscribe<fsmsg::processing_time_t>(kReconstructionTime, note);
  hub_.Subscribe<fsmsg::processing_time_t>(kFusionTime, note);
  hub_.Subscribe<fsmsg::processing_time_t>(kRegistrationTime, note);
  SubscribeState<fsmsg::service_state_t>(hub_.bus(), kServiceState, [this](const auto& state) {
    tally_.Note(state, hub_.bus().NowUs());
    OnRobotState(state);
  });
}

// The line counts from the beginning again: two arrivals of a number are two parts, and so is an arrival
// after the events of a part whose own was not seen.
bool ReportService::EndEarlierPart(const fsmsg::part_arrived_t& arrived) {
  const auto open = open_.find(arrived.part);
  const bool unfinished = open != open_.end() && (open->second.work.arrived.has_value() ||
                                                  open->second.work.first_utime < arrived.utime);
  if (unfinished) {
    Finish(arrived.part);
  }
  const FinishedPart* finished = finished_.Find(arrived.part);
  const bool earlier =
      finished != nullptr && (unfinished || finished->arrived.has_value() || finished->utime < arrived.utime);
  if (earlier) {
    finished_.Take(arrived.part);
  }
  return earlier;
}

void ReportService::OnArrived(const fsmsg::part_arrived_t& message) {
  const bool again = EndEarlierPart(message);
  if (PartInWork* work = Find(message.part, message.utime); work != nullptr) {
    work->arrived = message;
    Note(kept_.Arrived(message.part, message.utime));
    if (again) {
      work->ignore_before_utime = message.utime;
    }
  }
}

void ReportService::OnSlice(const fsmsg::cloud_slice_t& message) {
  PartInWork* work = FindScan(message.part, message.utime);
  if (work == nullptr) {
    return;
  }
  Note(kept_.ResultsCame(message.part));
  Result<std::optional<PointCloud>> cloud = assembler_.Add(message);
  if (!cloud.ok()) {
    work->cloud_error = fmt::format("The registered points cannot be used: {}.", cloud.error().message);
    Note(cloud.error());
  } else if (cloud->has_value()) {
    work->cloud_in_model = std::move(**cloud);
  }
  FinishIfComplete(message.part);
}

PartInWork* ReportService::Find(int part, std::int64_t utime) {
  if (const auto open = open_.find(part); open != open_.end()) {
    PartInWork& work = open->second.work;
    if (utime < work.ignore_before_utime) {
      return nullptr;
    }
    work.first_utime = std::min(work.first_utime, utime);
    return &work;
  }
  return IsLate(part, utime) ? nullptr : &OpenPart(part, utime);
}

PartInWork* ReportService::FindScan(int part, std::int64_t end_utime) {
  const auto open = open_.find(part);
  const std::int64_t known_utime =
      open == open_.end() ? end_utime : open->second.work.scan_end_utime.value_or(end_utime);
  if (end_utime < known_utime) {
    return nullptr;
  }
  if (end_utime > known_utime) {
    Finish(part);  // another with its number came: nothing more will come of this one
  }
  PartInWork* work = Find(part, end_utime);
  if (work != nullptr) {
    work->scan_end_utime = end_utime;
  }
  return work;
}

void ReportService::NoteScan(int part, std::int64_t start_utime, std::int64_t end_utime) {
  FinishedPart* finished = finished_.Find(part);
  if (finished != nullptr && finished->arrived.has_value() && finished->arrived->utime == start_utime) {
    finished->last_utime = std::max(finished->last_utime, end_utime);
  }
}

bool ReportService::IsLate(int part, std::int64_t utime) {
  const FinishedPart* finished = finished_.Find(part);
  return finished != nullptr && utime <= finished->last_utime;
}

PartInWork& ReportService::OpenPart(int part, std::int64_t utime) {
  Open& open = open_[part];
  open.work.part = part;
  open.work.first_utime = utime;
  if (const FinishedPart* finished = finished_.Find(part); finished != nullptr) {
    open.work.ignore_before_utime = finished->last_utime + 1;
  }
  open.work.sums_at_opening = tally_.Sums();
  Note(kept_.Begin(part, utime));
  open.timeout = hub_.bus().At(hub_.bus().NowUs() + config_.part_timeout_us(), [this, part] {
    monitor_.Count("parts_timed_out");
    Finish(part);
  });
  TellState();
  return open.work;
}

void ReportService::FinishIfComplete(int part) {
  if (open_.at(part).work.Complete()) {
    Finish(part);
  }
}

PartReport ReportService::Judge(const PartInWork& work) const {
  PartReport report = ReportOf(work);
  report.station = station_.name;
  report.software_version = station_.software_version;
  report.config_hash = station_.config_hash;
  const std::string obstacle = work.Obstacle();
  const auto measured = obstacle.empty() ? evaluator_.Evaluate(*work.cloud_in_model)
                                         : Result<std::vector<MeasuredDimension>>(evaluator_.Dimensions());
  if (!obstacle.empty() || !measured.ok()) {
    const std::string reason = obstacle.empty() ? measured.error().message : obstacle;
    report.dimensions = NotInspected(evaluator_.Dimensions(), reason);
    report.verdict = {Verdict::kNotInspected, reason};
    return report;
  }
  report.dimensions = JudgeDimensions(*measured, config_.uncertainty, work.registration->reference_degc);
  report.verdict = JudgePart(report.dimensions);
  return report;
}

void ReportService::Finish(int part) {
  GiveVerdict(part);
  TellState();
}

void ReportService::GiveVerdict(int part) {
  const std::int64_t started_us = hub_.bus().NowUs();
  JudgedPart judged;
  judged.work = std::move(open_.at(part).work);
  hub_.bus().Cancel(open_.at(part).timeout);
  open_.erase(part);
  assembler_.Forget(part);
  const std::int64_t utime = judged.work.EventUtime();
  // Where the end of the scan is not known, it comes within the time that a part is waited for.
  const std::int64_t last_utime = judged.work.scan_end_utime.value_or(utime + config_.part_timeout_us());
  finished_.Insert(part, {utime, last_utime, judged.work.arrived});
  judged.report = Judge(judged.work);
  PartReport& report = judged.report;
  report.verdict_utime = hub_.bus().NowUs();
  report.timing_s.report = static_cast<double>(report.verdict_utime - started_us) / kUsPerSecond;
  if (report.last_view_utime > 0) {
    report.timing_s.last_frame_to_verdict = static_cast<double>(report.verdict_utime - utime) / kUsPerSecond;
  }
  judged.folder_name = ReportFolderName(part, utime);
  Publish(report, utime);
  pages_.Add(std::move(judged));
}

// What goes wrong with files is told, but never keeps the verdict from the line.
void ReportService::Publish(const PartReport& report, std::int64_t utime) {
  const std::string folder_name = ReportFolderName(report.part, utime);
  const fsmsg::verdict_t verdict = VerdictMessage(report, utime, folder_name);
  Note(kept_.Judged(verdict));  // from here on it is this verdict, whatever ends this process
  Note(writer_.WriteJson(report, folder_name));
  Note(hub_.Publish(kVerdict, verdict));
  Note(writer_.Remember(report, utime));
  monitor_.Count(CounterName(report.verdict.verdict));
}

void ReportService::TellState() {
  const bool idle = open_.empty();
  monitor_.SetState(idle ? ServiceState::kReady : ServiceState::kWorking,
                    idle ? "waiting for a part" : fmt::format("{} parts in work", open_.size()));
}

void ReportService::Note(const Status& status) {
  if (!status.ok()) {
    monitor_.ReportError(status.error());
  }
}

}  // namespace forgescan
