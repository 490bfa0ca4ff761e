#include "services/trigger/trigger_service.h"

namespace forgescan {
namespace {

constexpr std::int64_t kStepPeriod_us = 5'000;

template <typename Message>
void SetView(Message& message, const ViewRequest& view) {
  message.part = view.part;
  message.view = view.view;
  message.attempt = view.attempt;
}

}  // namespace

TriggerService::TriggerService(StreamHub& hub, ServiceMonitor& monitor, Trigger& device,
                               const TriggerConfig& config)
    : hub_(hub), monitor_(monitor), device_(device), machine_(config) {
  hub_.Advertise(kExposure);
  hub_.Advertise(kViewCaptured);
  hub_.Subscribe<fsmsg::view_ready_t>(kViewReady, [this](const fsmsg::view_ready_t& m) {
    Do(machine_.OnViewReady({m.utime, m.part, m.view, m.attempt}, Now()));
  });
  SubscribeState<fsmsg::path_state_t>(hub_.bus(), kPathState, [this](const fsmsg::path_state_t& m) {
    Do(machine_.OnPosition(m.in_position != 0, Now()));
  });
  SubscribeState<fsmsg::cooling_state_t>(hub_.bus(), kCoolingState, [this](const fsmsg::cooling_state_t& m) {
    const bool free = m.interlock == fsmsg::cooling_state_t::INTERLOCK_CLEAR ||
                      m.interlock == fsmsg::cooling_state_t::INTERLOCK_WARN;  // UNKNOWN stops
    Do(machine_.OnInterlock(!free, m.reason, Now()));
  });
  device_.SetHandler([this](const TriggerEvent& event) { OnEvent(event); });
  timer_ = hub_.bus().Every(kStepPeriod_us, [this] {
    device_.Step(Now());
    Do(machine_.OnTick(Now()));
  });
  monitor_.SetState(ServiceState::kStarting, "the trigger microcontroller does not answer yet");
}

TriggerService::~TriggerService() {
  hub_.bus().Cancel(timer_);
  device_.SetHandler({});
}

void TriggerService::OnEvent(const TriggerEvent& event) {
  if (const auto* link = std::get_if<DeviceLink>(&event)) {
    monitor_.SetState(link->up ? ServiceState::kReady : ServiceState::kError,
                      link->up ? "waiting for a view" : "the trigger microcontroller does not answer");
    Do(machine_.OnLink(link->up, Now()));
  } else if (const auto* fault = std::get_if<DeviceFault>(&event)) {
    Do(machine_.OnFault(*fault, Now()));
  } else if (const auto* status = std::get_if<TriggerStatus>(&event)) {
    Do(machine_.OnStatus(*status));
  } else if (const auto* pulse = std::get_if<TriggerPulse>(&event)) {
    Do(machine_.OnPulse(*pulse));
  }
}

void TriggerService::Do(const TriggerMachine::Actions& actions) {
  for (const TriggerAction& action : actions) {
    std::visit([this](const auto& one) { Do(one); }, action);
  }
}

void TriggerService::Note(const Status& status) {
  if (!status.ok()) {
    monitor_.ReportError(status.error());
  }
}

void TriggerService::Do(const TriggerCommand& command) { Note(device_.Send(command)); }

void TriggerService::Do(const ExposureRecord& record) {
  fsmsg::exposure_t message{};
  message.utime = record.utime;
  SetView(message, record.view);
  message.camera = record.right ? fsmsg::exposure_t::CAMERA_RIGHT : fsmsg::exposure_t::CAMERA_LEFT;
  message.pattern = record.pattern;
  message.pulse = record.pulse;
  message.device_time_us = record.device_time_us;
  message.exposure_us = record.exposure_us;
  monitor_.Count("pulses");
  Note(hub_.Publish(kExposure, message));
}

void TriggerService::Do(const ViewOutcome& outcome) {
  fsmsg::view_captured_t message{};
  message.utime = outcome.utime;
  SetView(message, outcome.view);
  message.status =
      outcome.captured ? fsmsg::view_captured_t::STATUS_CAPTURED : fsmsg::view_captured_t::STATUS_VOID;
  message.pulses_expected = outcome.pulses_expected;
  message.pulses_left = outcome.pulses[0];
  message.pulses_right = outcome.pulses[1];
  message.reason = outcome.reason;
  monitor_.Count(outcome.captured ? "views_captured" : "views_void");
  Note(hub_.Publish(kViewCaptured, message));
}

void TriggerService::Do(const TriggerNote& note) {
  monitor_.Count("events_out_of_place");
  monitor_.ReportError(Fail(ErrorCode::kProtocol, "{}", note.text));
}

}  // namespace forgescan
