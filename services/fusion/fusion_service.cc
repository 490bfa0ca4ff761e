#include "services/fusion/fusion_service.h"

#include <fmt/format.h>

#include <cmath>
#include <limits>

#include "services/common/bus/channels.h"
#include "services/common/service/step_timer.h"

namespace forgescan {
namespace {

constexpr std::size_t kMaxPartsInWork = 8;
constexpr std::size_t kFinishedKept = 64;
constexpr std::int64_t kNever = std::numeric_limits<std::int64_t>::min();
// A view that is being exposed when a scan is broken off is finished, and so is later than the scan's end.
constexpr std::int64_t kAfterScanUs = 10'000'000;

}  // namespace

FusionService::FusionService(StreamHub& hub, ServiceMonitor& monitor, FusionConfig config, FusionFiles files)
    : hub_(hub),
      monitor_(monitor),
      config_(std::move(config)),
      files_(std::move(files)),
      parts_(kMaxPartsInWork),
      finished_(kFinishedKept) {
  hub_.Advertise(kFusedCloud);
  hub_.Advertise(kFusionResult);
  hub_.Advertise(kFusionTime);
  hub_.Subscribe<fsmsg::part_arrived_t>(kPartArrived, [this](const auto& arrived) { OnArrived(arrived); });
  hub_.Subscribe<fsmsg::view_ready_t>(kViewReady, [this](const auto& ready) { OnViewReady(ready); });
  hub_.Subscribe<fsmsg::view_result_t>(kViewResult, [this](const auto& result) {
    if (PartCollector* part = Part(result)) {
      part->OnViewResult(result);
      FinishIfSettled(result.part);
    }
  });
  hub_.Subscribe<fsmsg::part_temperature_t>(kPartTemperature, [this](const auto& temperature) {
    if (PartCollector* part = Part(temperature)) {
      part->OnTemperature(temperature);
      FinishIfSettled(temperature.part);
    }
  });
  hub_.Subscribe<fsmsg::cloud_slice_t>(kViewCloud, [this](const auto& slice) { OnCloudSlice(slice); });
  hub_.Subscribe<fsmsg::scan_complete_t>(kScanComplete, [this](const auto& scan) { OnScanComplete(scan); });
  monitor_.SetState(ServiceState::kReady, "waiting for a part");
}

template <typename Message>
PartCollector* FusionService::Part(const Message& message) {
  const Finished* finished = finished_.Find(message.part);
  std::int64_t late_utime = finished != nullptr ? finished->utime + kAfterScanUs : kNever;
  PartCollector* part = parts_.Find(message.part);
  if (part != nullptr && part->scan().has_value() && message.utime > part->scan()->utime + kAfterScanUs) {
    late_utime = part->scan()->utime + kAfterScanUs;
    part = nullptr;
    Drop(message.part);
  }
  if (part == nullptr && message.utime > late_utime) {
    part = &Begin(message.part);
    part->IgnoreBefore(late_utime + 1);
  }
  if (part == nullptr || !part->Admits(message.utime)) {
    monitor_.Count("messages_late");
    return nullptr;
  }
  return part;
}

PartCollector& FusionService::Begin(int part) {
  if (const auto dropped = parts_.Insert(part, PartCollector())) {
    monitor_.ReportError(
        Fail(ErrorCode::kUntrusted, "part {} never finished and is dropped", dropped->first));
    assembler_.Forget(dropped->first);
  }
  return *parts_.Find(part);
}

// The line counts from the beginning again: two arrivals of a number are two parts, and so is an arrival
// after the scan of a part whose own was not seen.
bool FusionService::EndEarlierPart(const fsmsg::part_arrived_t& arrived) {
  const Finished* finished = finished_.Find(arrived.part);
  if (finished != nullptr && (finished->arrived || arrived.utime > finished->utime)) {
    finished_.Take(arrived.part);
    return true;
  }
  const PartCollector* open = parts_.Find(arrived.part);
  if (open == nullptr || !open->IsBefore(arrived)) {
    return false;
  }
  Drop(arrived.part);
  return true;
}

void FusionService::Drop(int part) {
  parts_.Take(part);
  assembler_.Forget(part);
  monitor_.ReportError(Fail(ErrorCode::kUntrusted,
                            "part {} never finished and is dropped: another with its number has come", part));
}

void FusionService::OnArrived(const fsmsg::part_arrived_t& arrived) {
  const bool again = EndEarlierPart(arrived);
  if (PartCollector* part = Part(arrived)) {
    if (again) {
      part->IgnoreBefore(arrived.utime);
    }
    part->OnArrived(arrived);
    FinishIfSettled(arrived.part);
  }
}

void FusionService::OnViewReady(const fsmsg::view_ready_t& ready) {
  const double change_k = std::abs(ready.robot_body_degc - files_.matrices.recorded_body_degc);
  if (change_k <= config_.max_body_change_k) {  // not so for NaN
    return;
  }
  const std::string reason = fmt::format(
      "the robot's body has {:.1f} degC, {:.1f} degC when the view matrices were taught, allowed are {} K",
      ready.robot_body_degc, files_.matrices.recorded_body_degc, config_.max_body_change_k);
  monitor_.Count("views_off_temperature");
  monitor_.ReportError(Fail(ErrorCode::kUntrusted, "part {} view {}: {}", ready.part, ready.view, reason));
  PartCollector* part = config_.body_change_voids ? Part(ready) : nullptr;
  if (part != nullptr) {
    part->SetViewVoid(ready.view, reason);
  }
}

void FusionService::OnCloudSlice(const fsmsg::cloud_slice_t& slice) {
  PartCollector* part = Part(slice);
  if (part == nullptr) {
    return;
  }
  Result<std::optional<PointCloud>> cloud = assembler_.Add(slice);
  if (!cloud.ok()) {
    monitor_.ReportError(cloud.error());
  } else if (cloud->has_value()) {
    auto taught_from_actual = Correct(slice.part, slice.view, **cloud);
    part->OnCloud(slice.view, slice.utime, std::move(**cloud), std::move(taught_from_actual));
    FinishIfSettled(slice.part);
  }
}

Result<Eigen::Isometry3d> FusionService::Correct(int part, int view, const PointCloud& cloud) {
  if (!files_.correction.has_value()) {
    return Eigen::Isometry3d::Identity();
  }
  const Result<CorrectedVisit> visit = files_.correction->Of(view, cloud);
  if (!visit.ok()) {
    monitor_.Count("views_knocked");
    monitor_.ReportError(Fail(visit.error().code, "part {} view {}: {}", part, view, visit.error().message));
    return visit.error();
  }
  monitor_.Count(visit->corrected ? "views_corrected" : "views_uncorrected");
  monitor_.SetCounter("last_view_cells", static_cast<std::int64_t>(visit->cells));
  monitor_.SetCounter("last_view_shift_um", std::llround(visit->shift_um));
  monitor_.SetCounter("last_view_turn_urad", std::llround(visit->turn_urad));
  monitor_.SetState(ServiceState::kReady, fmt::format("part {} view {}: {}", part, view, visit->text));
  return visit->taught_from_actual;
}

void FusionService::OnScanComplete(const fsmsg::scan_complete_t& scan) {
  PartCollector* collector = Part(scan);
  if (collector == nullptr) {
    return;
  }
  collector->OnScanComplete(scan);
  const auto timeout_us = static_cast<std::int64_t>(config_.view_timeout_s * 1e6);
  hub_.bus().At(hub_.bus().NowUs() + timeout_us, [this, part = scan.part, utime = scan.utime] {
    PartCollector* late = parts_.Find(part);
    if (late != nullptr && late->scan().has_value() && late->scan()->utime == utime) {
      late->Expire(fmt::format("no result within {} s of the scan", config_.view_timeout_s));
      FinishIfSettled(part);
    }
  });
  FinishIfSettled(scan.part);
}

void FusionService::FinishIfSettled(int part) {
  const PartCollector* collector = parts_.Find(part);
  if (collector != nullptr && collector->Settled()) {
    auto settled = parts_.Take(part);
    finished_.Insert(part, {settled->scan()->utime, settled->arrived().has_value()});
    assembler_.Forget(part);
    Finish(part, *settled);
  }
}

std::string FusionService::VoidReason(const PartCollector& collector,
                                      const PartCollector::Views& views) const {
  if (!collector.arrived().has_value()) {
    return "the part's arrival was not seen";
  }
  const auto crc = static_cast<std::uint32_t>(collector.arrived()->path_crc32);
  if (crc != files_.matrices.path_crc32) {
    return fmt::format("the robot's path {:08x} is not the one the view matrices were taught on, {:08x}", crc,
                       files_.matrices.path_crc32);
  }
  std::string voids;  // the first with its reason; the table of views has the others'
  for (const auto& view : views.summary) {
    if (view.status != fsmsg::view_result_t::STATUS_OK) {
      voids += voids.empty() ? fmt::format("view {} ({})", view.view, view.reason)
                             : fmt::format(", view {}", view.view);
    }
  }
  const auto missing = static_cast<int>(views.summary.size() - views.clouds.size());
  return missing > config_.missing_views_allowed ? "void views: " + voids : std::string();
}

void FusionService::Finish(int part, PartCollector& collector) {
  const StepTimer timer(hub_, "fusion", part, kAllViews);
  PartCollector::Views views = collector.TakeViews();
  fsmsg::fusion_result_t result{};
  result.utime = views.scan_utime;
  result.part = part;
  result.reason = VoidReason(collector, views);
  result.reference_degc = config_.reference_temperature_degc;
  result.scan_start_utime = collector.scan()->scan_start_utime;
  result.frames_expected = views.frames_expected;
  result.frames_used = views.frames_used;
  PointCloud cloud;
  if (result.reason.empty()) {
    const auto& fixed = config_.fixed_point_mm;
    Result<FusedCloud> fused =
        FuseViews(views.clouds, files_.matrices, files_.curve,
                  {config_.reference_temperature_degc, {fixed[0], fixed[1], fixed[2]}});
    result.reason = fused.ok() ? std::string() : fused.error().message;
    if (fused.ok()) {
      cloud = std::move(fused->cloud_in_array);
      for (std::size_t i = 0; i < views.clouds.size(); ++i) {
        views.summary[static_cast<std::size_t>(views.clouds[i].view)].scale = fused->scales[i];
      }
    }
  }
  result.status = result.reason.empty() ? fsmsg::view_result_t::STATUS_OK : fsmsg::view_result_t::STATUS_VOID;
  result.views = std::move(views.summary);
  result.view_count = static_cast<std::int32_t>(result.views.size());
  Publish(std::move(result), cloud);
  timer.Finish(kFusionTime, monitor_, views.scan_utime);
}

void FusionService::Publish(fsmsg::fusion_result_t result, const PointCloud& cloud) {
  result.points = static_cast<std::int32_t>(cloud.size());
  const auto publish = [&]() -> Status {
    if (result.status == fsmsg::view_result_t::STATUS_OK) {
      ASSIGN_OR_RETURN(const auto slices, SliceCloud(cloud, result.utime, result.part, kAllViews));
      for (const auto& slice : slices) {
        RETURN_IF_ERROR(hub_.Publish(kFusedCloud, slice));
      }
    }
    return hub_.Publish(kFusionResult, result);
  };
  if (const Status sent = publish(); !sent.ok()) {
    monitor_.ReportError(sent.error());
  }
  if (!result.reason.empty()) {
    monitor_.ReportError(Fail(ErrorCode::kUntrusted, "part {}: {}", result.part, result.reason));
  }
  monitor_.Count(result.reason.empty() ? "parts_fused" : "parts_void");
  monitor_.SetState(ServiceState::kReady, fmt::format("part {}: {} points", result.part, result.points));
}

}  // namespace forgescan
