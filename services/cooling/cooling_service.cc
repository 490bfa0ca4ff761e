#include "services/cooling/cooling_service.h"

#include <limits>

#include "services/common/bus/channels.h"

namespace forgescan {
namespace {

constexpr std::int64_t kStepPeriod_us = 10'000;
constexpr std::int64_t kControlPeriod_us = 200'000;  // the unit falls back after 1 s without a command
constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

ServiceState StateOf(Interlock interlock) {
  switch (interlock) {
    case Interlock::kUnknown:
      return ServiceState::kStarting;
    case Interlock::kClear:
      return ServiceState::kWorking;
    case Interlock::kWarn:
      return ServiceState::kDegraded;
    case Interlock::kStopInspection:
    case Interlock::kPowerOff:
      break;
  }
  return ServiceState::kError;
}

}  // namespace

CoolingService::CoolingService(StreamHub& hub, ServiceMonitor& monitor, CoolingUnit& unit,
                               const CoolingConfig& config)
    : hub_(hub), monitor_(monitor), unit_(unit), config_(config), controller_(config) {
  temperatures_ = {.inlet_degc = kNaN, .outlet_degc = kNaN, .ambient_degc = kNaN, .hot_side_degc = kNaN};
  unit_.SetHandler([this](const CoolingEvent& event) { OnEvent(event); });
  step_timer_ = hub_.bus().Every(kStepPeriod_us, [this] { unit_.Step(hub_.bus().NowUs()); });
  tick_timer_ = hub_.bus().Every(kControlPeriod_us, [this] { Tick(); });
}

CoolingService::~CoolingService() {
  hub_.bus().Cancel(step_timer_);
  hub_.bus().Cancel(tick_timer_);
  unit_.SetHandler({});
}

void CoolingService::OnEvent(const CoolingEvent& event) {
  if (const auto* link = std::get_if<DeviceLink>(&event)) {
    link_up_ = link->up;
    controller_.OnLink(link->up);
  } else if (const auto* fault = std::get_if<DeviceFault>(&event)) {
    if (fault->code != 0) {
      monitor_.ReportError(
          Fail(ErrorCode::kUnavailable, "the cooling unit reports fault {:#06x}", fault->code));
    }
  } else if (const auto* status = std::get_if<CoolingStatus>(&event)) {
    controller_.OnUnit({status->utime, status->flow_lpm, status->pump_on, status->humidity_pct});
  } else if (const auto* t = std::get_if<CoolingTemperatures>(&event)) {
    temperatures_ = *t;
    controller_.OnTemperatures({t->utime, t->inlet_degc, t->outlet_degc, t->ambient_degc, t->hot_side_degc});
  }
}

void CoolingService::Tick() {
  const CoolingOutput output = controller_.Tick(hub_.bus().NowUs());
  if (link_up_) {
    const Status sent =
        unit_.Send({output.duty, output.pump_on, output.projector_off, output.sensor_power_off});
    if (!sent.ok()) {
      monitor_.ReportError(sent.error());
    }
  }
  Publish(output);
  ShowState(output);
}

void CoolingService::Publish(const CoolingOutput& output) {
  fsmsg::cooling_state_t message{};
  message.utime = temperatures_.utime != 0 ? temperatures_.utime : hub_.bus().NowUs();
  message.inlet_degc = temperatures_.inlet_degc;
  message.outlet_degc = temperatures_.outlet_degc;
  message.ambient_degc = temperatures_.ambient_degc;
  message.inside_degc = output.inside_degc;
  message.setpoint_degc = config_.setpoint_degc;
  message.duty = output.duty;
  message.interlock = static_cast<std::int8_t>(output.interlock);
  message.reason = output.reason;
  if (const Status sent = PublishState(hub_.bus(), kCoolingState, message); !sent.ok()) {
    monitor_.ReportError(sent.error());
  }
}

void CoolingService::ShowState(const CoolingOutput& output) {
  const ServiceState state = StateOf(output.interlock);
  if (state != monitor_.state()) {
    monitor_.SetState(state, output.reason.empty() ? "regulating" : output.reason);
  }
}

}  // namespace forgescan
