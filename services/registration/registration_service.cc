#include "services/registration/registration_service.h"

#include <fmt/format.h>

#include <algorithm>
#include <limits>

#include "services/common/bus/channels.h"
#include "services/common/service/step_timer.h"

namespace forgescan {
namespace {

constexpr std::size_t kMaxPartsInWork = 8;
using Message = fsmsg::registration_t;

// The chosen points, moved into the model frame.
PointCloud MovePoints(const PointCloud& cloud_in_array, const std::vector<std::uint32_t>& chosen,
                      const Eigen::Isometry3d& model_from_array) {
  const Eigen::Matrix3f rotation = model_from_array.linear().cast<float>();
  PointCloud cloud_in_model;
  for (const std::uint32_t i : chosen) {
    const Eigen::Vector3d p_in_model = model_from_array * cloud_in_array.points[i].cast<double>();
    cloud_in_model.points.push_back(p_in_model.cast<float>());
    cloud_in_model.normals.push_back(rotation * cloud_in_array.normals[i]);
    cloud_in_model.sigma_mm.push_back(cloud_in_array.sigma_mm[i]);
    cloud_in_model.view.push_back(cloud_in_array.view[i]);
  }
  return cloud_in_model;
}

Message NoPose(const fsmsg::fusion_result_t& fusion) {
  Message message{};
  message.utime = fusion.utime;
  message.part = fusion.part;
  message.reference_degc = fusion.reference_degc;
  constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
  std::fill(std::begin(message.model_from_array), std::end(message.model_from_array), kNone);
  message.rms_mm = message.inlier_share = message.foreign_share = message.shift_mm = kNone;
  message.turn_rad = message.weakest_eigenvalue = kNone;
  return message;
}

}  // namespace

RegistrationService::RegistrationService(StreamHub& hub, ServiceMonitor& monitor, RegistrationConfig config,
                                         RegistrationModel model)
    : hub_(hub),
      monitor_(monitor),
      config_(std::move(config)),
      model_(std::move(model)),
      parts_(kMaxPartsInWork) {
  hub_.Advertise(kRegisteredCloud);
  hub_.Advertise(kRegistration);
  hub_.Advertise(kRegistrationTime);
  hub_.Subscribe<fsmsg::cloud_slice_t>(kFusedCloud, [this](const auto& slice) { OnSlice(slice); });
  hub_.Subscribe<fsmsg::fusion_result_t>(kFusionResult, [this](const auto& fusion) { OnFusion(fusion); });
  hub_.OnLost(kFusedCloud, [this](std::int64_t first, std::int64_t last) { OnLost(first, last); });
  monitor_.SetState(ServiceState::kReady, "waiting for a part");
}

RegistrationService::Part& RegistrationService::InWork(Key key) {
  if (parts_.Find(key) == nullptr) {
    if (const auto dropped = parts_.Insert(key, Part())) {
      const auto [part, utime] = dropped->first;
      monitor_.ReportError(Fail(ErrorCode::kUntrusted, "part {} never became complete and is dropped", part));
      assembler_.Forget(part, utime);
    }
  }
  return *parts_.Find(key);
}

// The slices may have been any waiting part's.
void RegistrationService::OnLost(std::int64_t first, std::int64_t last) {
  const std::string lost = fmt::format("slices {} to {} of the fused clouds are lost", first, last);
  parts_.ForEach([&lost](Key, Part& part) { part.lost = "; " + lost; });
  monitor_.ReportError(Fail(ErrorCode::kUnavailable, "{}", lost));
}

void RegistrationService::OnSlice(const fsmsg::cloud_slice_t& slice) {
  Result<std::optional<PointCloud>> cloud = assembler_.Add(slice);
  if (!cloud.ok()) {
    return monitor_.ReportError(cloud.error());
  }
  if (cloud->has_value()) {
    const Key key{slice.part, slice.utime};
    InWork(key).cloud_in_array = std::move(**cloud);
    FinishIfComplete(key);
  }
}

void RegistrationService::OnFusion(const fsmsg::fusion_result_t& fusion) {
  const Key key{fusion.part, fusion.utime};
  InWork(key).fusion = fusion;
  FinishIfComplete(key);
  const auto timeout_us = static_cast<std::int64_t>(config_.cloud_timeout_s * 1e6);
  hub_.bus().At(hub_.bus().NowUs() + timeout_us, [this, key] {
    const Part* late = parts_.Find(key);
    if (late != nullptr && late->fusion.has_value()) {
      GiveUp(key);
    }
  });
}

void RegistrationService::GiveUp(Key key) {
  const auto taken = parts_.Take(key);
  assembler_.Forget(key.first, key.second);
  Message message = NoPose(*taken->fusion);
  message.status = Message::STATUS_FAILED;
  message.reason = fmt::format("the fused cloud is not whole {} s after its result{}",
                               config_.cloud_timeout_s, taken->lost);
  if (const Status sent = Publish(message, {}); !sent.ok()) {
    monitor_.ReportError(sent.error());
  }
}

void RegistrationService::FinishIfComplete(Key key) {
  const Part* found = parts_.Find(key);
  if (found == nullptr || !found->fusion.has_value()) {
    return;
  }
  const bool has_cloud = found->fusion->status == fsmsg::view_result_t::STATUS_OK;
  if (has_cloud && !found->cloud_in_array.has_value()) {
    return;
  }
  const auto taken = parts_.Take(key);
  Finish(*taken->fusion, taken->cloud_in_array.value_or(PointCloud()));
}

PointCloud RegistrationService::Register(const PointCloud& cloud_in_array, Message& message) const {
  const auto registration = RegisterScan(cloud_in_array, model_, config_.model_from_array, config_.icp);
  if (!registration.ok()) {
    message.status = Message::STATUS_FAILED;
    message.reason = registration.error().message;
    return {};
  }
  const Eigen::Isometry3d& pose = registration->model_from_scan;
  const auto part_points = FindPartPoints(cloud_in_array, model_, pose, config_.classify);
  message.status = Message::STATUS_CONVERGED;
  Eigen::Map<Eigen::Matrix<double, 4, 4, Eigen::RowMajor>>(&message.model_from_array[0]) = pose.matrix();
  message.iterations = registration->iterations;
  message.rms_mm = registration->rms_mm;
  message.inlier_share = registration->inlier_share;
  message.foreign_share =
      1.0 - static_cast<double>(part_points.size()) / static_cast<double>(cloud_in_array.size());
  message.shift_mm = registration->correction_mm;
  message.turn_rad = registration->correction_rad;
  message.weakest_eigenvalue = registration->weakest_eigenvalue;
  return MovePoints(cloud_in_array, part_points, pose);
}

void RegistrationService::Finish(const fsmsg::fusion_result_t& fusion, const PointCloud& cloud_in_array) {
  const StepTimer timer(hub_, "registration", fusion.part, kAllViews);
  Message message = NoPose(fusion);
  PointCloud cloud_in_model;
  if (fusion.status == fsmsg::view_result_t::STATUS_OK) {
    monitor_.SetState(ServiceState::kWorking, fmt::format("part {}", fusion.part));
    cloud_in_model = Register(cloud_in_array, message);
  } else {
    message.status = Message::STATUS_NOT_INSPECTED;
    message.reason = fusion.reason;
  }
  message.points = static_cast<std::int32_t>(cloud_in_model.size());
  if (const Status sent = Publish(message, cloud_in_model); !sent.ok()) {
    monitor_.ReportError(sent.error());
  }
  timer.Finish(kRegistrationTime, monitor_, message.utime);
}

Status RegistrationService::Publish(const Message& message, const PointCloud& cloud_in_model) {
  if (message.status == Message::STATUS_CONVERGED) {
    ASSIGN_OR_RETURN(const auto slices, SliceCloud(cloud_in_model, message.utime, message.part, kAllViews));
    for (const auto& slice : slices) {
      RETURN_IF_ERROR(hub_.Publish(kRegisteredCloud, slice));
    }
    monitor_.Count("parts_registered");
  } else {
    monitor_.Count("parts_without_pose");
    monitor_.ReportError(Fail(ErrorCode::kUntrusted, "part {}: {}", message.part, message.reason));
  }
  monitor_.SetState(ServiceState::kReady, fmt::format("part {}: {} points", message.part, message.points));
  return hub_.Publish(kRegistration, message);
}

}  // namespace forgescan
