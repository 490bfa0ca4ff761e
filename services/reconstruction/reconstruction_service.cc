#include "services/reconstruction/reconstruction_service.h"

#include <fmt/format.h>

#include <algorithm>

#include "services/common/bus/channels.h"
#include "services/common/bus/cloud_stream.h"
#include "services/common/service/step_timer.h"

namespace forgescan {
namespace {

constexpr std::size_t kMaxViewsInWork = 8;
constexpr std::size_t kFinishedKept = 64;  // some parts back

std::int64_t ToUs(double seconds) { return static_cast<std::int64_t>(seconds * 1e6); }

std::vector<cv::Mat> Images(const std::vector<const fsmsg::frame_t*>& frames) {
  std::vector<cv::Mat> images;
  for (const fsmsg::frame_t* frame : frames) {  // a view of the message's bytes, only read
    images.emplace_back(frame->height_px, frame->width_px, CV_8UC1,
                        const_cast<std::uint8_t*>(frame->data.data()));
  }
  return images;
}

std::int32_t Count(const std::array<long, kMaskCauses>& pixels, MaskCause cause) {
  return static_cast<std::int32_t>(pixels[static_cast<std::size_t>(cause)]);
}

void Describe(const CameraQuality& left, fsmsg::view_result_t& result) {
  result.pixels_valid = Count(left.pixels, MaskCause::kValid);
  result.mask_saturated = Count(left.pixels, MaskCause::kSaturated);
  result.mask_modulation = Count(left.pixels, MaskCause::kLowModulation);
  result.mask_noise = Count(left.pixels, MaskCause::kNoisy);
  result.mask_inconsistent =
      Count(left.pixels, MaskCause::kModulationRatio) + Count(left.pixels, MaskCause::kReference) +
      Count(left.pixels, MaskCause::kUnwrapMargin) + Count(left.pixels, MaskCause::kDisagreement);
  result.modulation_median_dn = left.median_modulation_dn;
  result.consistency_rms_rad = left.trust.disagreement_rad;
}

}  // namespace

ReconstructionService::ReconstructionService(StreamHub& hub, ServiceMonitor& monitor,
                                             const ReconstructionServiceConfig& config, PatternSet pattern,
                                             StereoCalibration calibration)
    : hub_(hub),
      monitor_(monitor),
      config_(config),
      pattern_(std::move(pattern)),
      calibration_(std::move(calibration)),
      views_(kMaxViewsInWork),
      finished_(kFinishedKept),
      arrived_(kFinishedKept) {
  hub_.Advertise(kViewCloud);
  hub_.Advertise(kViewResult);
  hub_.Advertise(kReconstructionTime);
  hub_.Subscribe<fsmsg::part_arrived_t>(kPartArrived, [this](const auto& arrived) { OnArrived(arrived); });
  hub_.Subscribe<fsmsg::view_captured_t>(kViewCaptured,
                                         [this](const auto& captured) { OnCaptured(captured); });
  const auto on_frame = [this](const fsmsg::frame_t& frame) {
    if (ViewCollector* view = View(frame)) {
      view->OnFrame(frame);
      FinishIfSettled({frame.part, frame.view});
    }
  };
  hub_.Subscribe<fsmsg::frame_t>(kFrameLeft, on_frame);
  hub_.Subscribe<fsmsg::frame_t>(kFrameRight, on_frame);
  const auto on_manifest = [this](const fsmsg::view_frames_t& manifest) {
    if (ViewCollector* view = View(manifest)) {
      view->OnManifest(manifest);
      FinishIfSettled({manifest.part, manifest.view});
    }
  };
  hub_.Subscribe<fsmsg::view_frames_t>(kViewFramesLeft, on_manifest);
  hub_.Subscribe<fsmsg::view_frames_t>(kViewFramesRight, on_manifest);
  monitor_.SetState(ServiceState::kReady, "waiting for frames");
}

// The line counts from the beginning again: what is older than the arrival is an earlier part's. On a clock
// that was set back meanwhile, what is younger than the arrival before is.
void ReconstructionService::OnArrived(const fsmsg::part_arrived_t& arrived) {
  const std::int64_t* before = arrived_.Find(arrived.part);
  const bool set_back = before != nullptr && arrived.utime < *before;
  const std::int64_t limit_utime = set_back ? *before : arrived.utime;
  const auto is_earlier = [&](Key key, std::int64_t utime) {
    return key.first == arrived.part && (set_back ? utime >= limit_utime : utime < limit_utime);
  };
  std::vector<Key> open, finished;
  views_.ForEach([&](Key key, const ViewCollector& view) {
    if (is_earlier(key, view.newest_utime())) {
      open.push_back(key);
    }
  });
  finished_.ForEach([&](Key key, const Finished& view) {
    if (is_earlier(key, view.utime)) {
      finished.push_back(key);
    }
  });
  std::ranges::for_each(open, [this](Key key) { Drop(key); });
  std::ranges::for_each(finished, [this](Key key) { finished_.Take(key); });
  arrived_.Insert(arrived.part, arrived.utime);
}

void ReconstructionService::Drop(Key key) {
  views_.Take(key);
  monitor_.ReportError(
      Fail(ErrorCode::kUntrusted,
           "part {} view {} never finished and is dropped: another with its numbers has come", key.first,
           key.second));
}

// A view's events lie within the timeout of its frames; the same numbers later are another part, whose
// arrival was not seen.
bool ReconstructionService::IsFinished(Key key, int attempt, std::int64_t utime) {
  const Finished* finished = finished_.Find(key);
  return finished != nullptr && attempt <= finished->attempt &&
         utime <= finished->utime + ToUs(config_.frame_timeout_s);
}

template <typename Message>
ViewCollector* ReconstructionService::View(const Message& message) {
  const Key key{message.part, message.view};
  const std::int64_t* arrived = arrived_.Find(message.part);
  if ((arrived != nullptr && message.utime < *arrived) || IsFinished(key, message.attempt, message.utime)) {
    monitor_.Count("messages_late");
    return nullptr;
  }
  const ViewCollector* open = views_.Find(key);
  if (open != nullptr && message.utime > open->newest_utime() + ToUs(config_.frame_timeout_s)) {
    Drop(key);
  }
  if (views_.Find(key) == nullptr) {
    if (const auto dropped = views_.Insert(key, ViewCollector(pattern_.frame_count()))) {
      monitor_.ReportError(Fail(ErrorCode::kUntrusted, "part {} view {} never finished and is dropped",
                                dropped->first.first, dropped->first.second));
    }
  }
  return views_.Find(key);
}

void ReconstructionService::OnCaptured(const fsmsg::view_captured_t& captured) {
  ViewCollector* view = View(captured);
  if (view == nullptr) {
    return;
  }
  const Key key{captured.part, captured.view};
  view->OnCaptured(captured);
  const std::int64_t timeout_us = ToUs(config_.frame_timeout_s);
  hub_.bus().At(hub_.bus().NowUs() + timeout_us, [this, key, utime = captured.utime] {
    ViewCollector* late = views_.Find(key);
    if (late != nullptr && late->captured_utime() == utime) {
      late->Expire(fmt::format("{} of {} frames came within {} s", late->frames_received(),
                               2 * pattern_.frame_count(), config_.frame_timeout_s));
      FinishIfSettled(key);
    }
  });
  FinishIfSettled(key);
}

void ReconstructionService::FinishIfSettled(Key key) {
  const ViewCollector* view = views_.Find(key);
  if (view != nullptr && view->state() != ViewCollector::State::kCollecting) {
    const auto settled = views_.Take(key);
    finished_.Insert(key, {settled->attempt(), settled->newest_utime()});
    Finish(key, *settled);
  }
}

Result<Reconstruction> ReconstructionService::Run(const ViewCollector& view) {
  const auto left = Images(view.Frames(fsmsg::exposure_t::CAMERA_LEFT));
  const auto right = Images(view.Frames(fsmsg::exposure_t::CAMERA_RIGHT));
  const ImageSize size{left.front().cols, left.front().rows};
  if (reconstructor_ == nullptr || size.width_px != image_size_.width_px ||
      size.height_px != image_size_.height_px) {
    ReconstructionConfig config = config_.reconstruction;
    config.keep_every_nth_point = config_.publish_every_nth_point;
    ASSIGN_OR_RETURN(Reconstructor made, Reconstructor::Create(pattern_, calibration_, size, config));
    reconstructor_ = std::make_unique<Reconstructor>(std::move(made));
    image_size_ = size;
  }
  return reconstructor_->Run(left, right);
}

void ReconstructionService::Finish(Key key, const ViewCollector& view) {
  const StepTimer timer(hub_, "reconstruction", key.first, key.second);
  fsmsg::view_result_t result{};
  result.utime = view.middle_utime();
  result.part = key.first;
  result.view = key.second;
  result.attempt = view.attempt();
  result.frames_expected = 2 * pattern_.frame_count();
  result.frames_used = view.frames_received();
  result.reason = view.void_reason();
  PointCloud cloud;
  if (view.state() == ViewCollector::State::kComplete) {
    monitor_.SetState(ServiceState::kWorking, fmt::format("part {} view {}", key.first, key.second));
    Result<Reconstruction> reconstruction = Run(view);
    result.reason = reconstruction.ok() ? std::string() : reconstruction.error().message;
    if (reconstruction.ok()) {
      Describe(reconstruction->quality.left, result);
      result.sigma_median_mm = reconstruction->quality.median_sigma_mm;
      cloud = std::move(reconstruction->cloud_in_camera);
      cloud.view.assign(cloud.size(), static_cast<std::uint16_t>(key.second));
    }
  }
  result.status = result.reason.empty() ? fsmsg::view_result_t::STATUS_OK : fsmsg::view_result_t::STATUS_VOID;
  result.points = static_cast<std::int32_t>(cloud.size());
  if (const Status sent = Publish(result, cloud); !sent.ok()) {
    monitor_.ReportError(sent.error());
  }
  timer.Finish(kReconstructionTime, monitor_, result.utime);
}

Status ReconstructionService::Publish(const fsmsg::view_result_t& result, const PointCloud& cloud) {
  if (result.reason.empty()) {
    ASSIGN_OR_RETURN(const auto slices, SliceCloud(cloud, result.utime, result.part, result.view));
    for (const auto& slice : slices) {
      RETURN_IF_ERROR(hub_.Publish(kViewCloud, slice));
    }
    monitor_.Count("views_reconstructed");
  } else {
    monitor_.Count("views_void");
    monitor_.ReportError(
        Fail(ErrorCode::kUntrusted, "part {} view {}: {}", result.part, result.view, result.reason));
  }
  monitor_.SetState(ServiceState::kReady,
                    fmt::format("part {} view {}: {} points", result.part, result.view, result.points));
  return hub_.Publish(kViewResult, result);
}

}  // namespace forgescan
