#include "services/robot/robot_service.h"

#include <cmath>
#include <limits>

namespace forgescan {
namespace {

constexpr std::int64_t kStepPeriod_us = 5'000;

struct Statistics {
  double mean = std::numeric_limits<double>::quiet_NaN();
  double spread = std::numeric_limits<double>::quiet_NaN();
};

Statistics StatisticsOf(const std::vector<double>& values) {
  if (values.empty()) {
    return {};
  }
  double sum = 0, squares = 0;
  for (const double value : values) {
    sum += value;
  }
  const auto count = static_cast<double>(values.size());
  for (const double value : values) {
    squares += (value - sum / count) * (value - sum / count);
  }
  return {sum / count, std::sqrt(squares / count)};
}

}  // namespace

RobotService::RobotService(StreamHub& hub, ServiceMonitor& monitor, const Devices& devices,
                           const RobotConfig& config, const std::string& memory_path)
    : hub_(hub),
      monitor_(monitor),
      devices_(devices),
      config_(config),
      machine_(config),
      sorter_(config),
      memory_(memory_path),
      body_degc_(std::numeric_limits<double>::quiet_NaN()),
      part_degc_(std::numeric_limits<double>::quiet_NaN()) {
  Subscribe();
  Resume();
  devices_.robot.SetHandler([this](const RobotEvent& event) { OnRobot(event); });
  devices_.line.SetHandler([this](const LineEvent& event) { OnLine(event); });
  timer_ = hub_.bus().Every(kStepPeriod_us, [this] { Step(); });
  if (config_.cooling_timeout_s > 0) {  // until the cooling service has spoken
    Do(machine_.OnInterlock(true, "no state of the cooling yet", Now()));
  }
  if (config_.require_recording) {
    machine_.HoldNextPart("recording interlock: no state of the recorder yet");
  }
  ShowState();
}

RobotService::~RobotService() {
  Do(machine_.OnStop(Now()));
  hub_.bus().Cancel(timer_);
  devices_.robot.SetHandler({});
  devices_.line.SetHandler({});
}

void RobotService::Subscribe() {
  hub_.Advertise(kPartArrived);
  hub_.Advertise(kViewReady);
  hub_.Advertise(kPartTemperature);
  hub_.Advertise(kScanComplete);
  hub_.Advertise(kPartSorted);
  hub_.Subscribe<fsmsg::view_captured_t>(kViewCaptured, [this](const fsmsg::view_captured_t& m) {
    const bool captured = m.status == fsmsg::view_captured_t::STATUS_CAPTURED;
    Do(machine_.OnCapture({m.utime, m.part, m.view, m.attempt, captured, m.reason}, Now()));
  });
  hub_.Subscribe<fsmsg::verdict_t>(kVerdict, [this](const fsmsg::verdict_t& m) { OnVerdict(m); });
  SubscribeState<fsmsg::cooling_state_t>(hub_.bus(), kCoolingState, [this](const fsmsg::cooling_state_t& m) {
    last_cooling_us_ = Now();
    const bool free = m.interlock == fsmsg::cooling_state_t::INTERLOCK_CLEAR ||
                      m.interlock == fsmsg::cooling_state_t::INTERLOCK_WARN;  // UNKNOWN stops
    Do(machine_.OnInterlock(!free, m.reason, Now()));
  });
  SubscribeState<fsmsg::recorder_state_t>(hub_.bus(), kRecorderState,
                                          [this](const fsmsg::recorder_state_t& m) { OnRecorder(m); });
}

void RobotService::Step() {
  devices_.robot.Step(Now());
  devices_.line.Step(Now());
  WatchCooling();
  WatchRecorder();
  Do(machine_.OnTick(Now()));
  DoSort(sorter_.OnTick(Now()));
}

void RobotService::WatchCooling() {
  const bool watched = config_.cooling_timeout_s > 0 && last_cooling_us_ != 0;
  if (watched && 1e-6 * static_cast<double>(Now() - last_cooling_us_) > config_.cooling_timeout_s) {
    last_cooling_us_ = 0;
    Do(machine_.OnInterlock(true, "the cooling service is silent", Now()));
  }
}

// An inspection without its record is the lesser evil than one broken off: only the next part has to wait.
void RobotService::OnRecorder(const fsmsg::recorder_state_t& recorder) {
  if (!config_.require_recording) {
    return;
  }
  last_recorder_us_ = Now();
  const bool recording = recorder.status == fsmsg::recorder_state_t::STATUS_RECORDING;  // UNKNOWN holds
  machine_.HoldNextPart(recording ? "" : fmt::format("recording interlock: {}", recorder.reason));
}

void RobotService::WatchRecorder() {
  if (last_recorder_us_ != 0 &&
      1e-6 * static_cast<double>(Now() - last_recorder_us_) > config_.recording_timeout_s) {
    last_recorder_us_ = 0;
    machine_.HoldNextPart("recording interlock: the recorder is silent");
  }
}

void RobotService::OnRobot(const RobotEvent& event) {
  if (const auto* link = std::get_if<DeviceLink>(&event)) {
    Do(machine_.OnLink(link->up, Now()));
  } else if (const auto* fault = std::get_if<DeviceFault>(&event)) {
    Do(machine_.OnFault(*fault, Now()));
  } else if (const auto* path = std::get_if<RobotPath>(&event)) {
    Do(machine_.OnPath(*path));
  } else if (const auto* motion = std::get_if<RobotMotion>(&event)) {
    body_degc_ = motion->body_degc;
    Do(machine_.OnMotion(*motion));
  } else if (const auto* status = std::get_if<RobotStatus>(&event)) {
    status_ = *status;
    PublishPath();  // before the machine acts: the trigger knows the position before it hears "view ready"
    Do(machine_.OnStatus(*status));
  }
}

void RobotService::OnLine(const LineEvent& event) {
  if (const auto* link = std::get_if<DeviceLink>(&event)) {
    Do(machine_.OnLineLink(link->up, Now()));
  } else if (const auto* fault = std::get_if<DeviceFault>(&event)) {
    Do(RobotNote{fmt::format("the line reports fault {:#06x}", fault->code)});
  } else if (const auto* part = std::get_if<LinePart>(&event)) {
    Do(machine_.OnPart(*part, Now()));
  } else if (const auto* reading = std::get_if<LinePyrometer>(&event)) {
    part_degc_ = reading->valid ? reading->part_degc : std::numeric_limits<double>::quiet_NaN();
    Do(machine_.OnPyrometer(*reading));
  } else if (const auto* echo = std::get_if<LineSortEcho>(&event)) {
    DoSort(sorter_.OnEcho(*echo));
  }
}

void RobotService::Do(const RobotMachine::Actions& actions) {
  for (const RobotAction& action : actions) {
    std::visit([this](const auto& one) { Do(one); }, action);
  }
  ShowState();
}

void RobotService::Do(const PartStarted& start) {
  fsmsg::part_arrived_t message{};
  message.utime = start.utime;
  message.part = start.part;
  message.view_count = start.view_count;
  message.path = config_.path;
  message.path_crc32 = static_cast<std::int32_t>(start.path_crc32);
  monitor_.Count("parts");
  Note(memory_.Begin(message.part, {.arrived_us = message.utime, .views = message.view_count}));
  Note(hub_.Publish(kPartArrived, message));
}

void RobotService::Do(const ViewSettled& view) {
  fsmsg::view_ready_t message{};
  message.utime = view.utime;
  message.part = view.part;
  message.view = view.view;
  message.attempt = view.attempt;
  message.settled_ms = view.settled_ms;
  message.robot_body_degc = view.body_degc;
  Note(hub_.Publish(kViewReady, message));
}

void RobotService::Do(const ScanFinished& scan) {
  fsmsg::scan_complete_t message{};
  message.utime = scan.utime;
  message.part = scan.part;
  const bool complete = scan.reason.empty();
  message.status =
      complete ? fsmsg::scan_complete_t::STATUS_COMPLETE : fsmsg::scan_complete_t::STATUS_ABORTED;
  message.views_expected = scan.views_expected;
  message.views_captured = scan.views_captured;
  message.scan_start_utime = scan.start_utime;
  message.reason = scan.reason;
  monitor_.Count(complete ? "scans_complete" : "scans_aborted");
  Note(memory_.Scanned(message.part));  // before it is told: never told twice
  Note(hub_.Publish(kScanComplete, message));
}

void RobotService::Do(const ViewTemperature& view) {
  const Statistics statistics = StatisticsOf(view.readings_degc);
  fsmsg::part_temperature_t message{};
  message.utime = view.utime;
  message.part = view.part;
  message.view = view.view;
  message.valid = view.readings_degc.empty() ? 0 : 1;
  message.temperature_degc = statistics.mean;
  message.spread_k = statistics.spread;
  message.readings = static_cast<std::int32_t>(view.readings_degc.size());
  Note(memory_.Captured(view.part, machine_.captured()));
  Note(hub_.Publish(kPartTemperature, message));
}

void RobotService::Do(const RobotNote& note) {
  monitor_.Count("events_out_of_place");
  monitor_.ReportError(Fail(ErrorCode::kProtocol, "{}", note.text));
}

void RobotService::DoSort(const SortMachine::Actions& actions) {
  for (const SortAction& action : actions) {
    if (const auto* command = std::get_if<LineCommand>(&action)) {
      Note(devices_.line.Send(*command));
    } else {
      PublishSorted(std::get<PartSorted>(action));
    }
  }
}

void RobotService::PublishSorted(const PartSorted& sorted) {
  fsmsg::part_sorted_t message{};
  message.utime = sorted.utime;
  message.part = static_cast<std::int32_t>(sorted.part);
  message.verdict = static_cast<std::int8_t>(sorted.verdict);
  message.acknowledged = sorted.acknowledged ? 1 : 0;
  message.reason = sorted.reason;
  monitor_.Count(sorted.acknowledged ? "parts_sorted" : "sort_failures");
  Note(memory_.Sorted(message.part));
  Note(hub_.Publish(kPartSorted, message));
}

void RobotService::PublishPath() {
  fsmsg::path_state_t message{};
  message.utime = status_.utime;
  message.part = machine_.part();
  message.view = machine_.view();
  message.state = static_cast<std::int8_t>(status_.state);  // the same numbers, 0 = boot = unknown
  message.in_position = status_.in_position;
  message.automatic = status_.automatic;
  message.drives_on = status_.drives_on;
  message.warm = status_.warm;
  message.protective_stop = status_.protective_stop;
  message.body_degc = body_degc_;
  message.part_degc = part_degc_;
  Note(PublishState(hub_.bus(), kPathState, message));
}

void RobotService::ShowState() {
  const std::string text = machine_.Text();
  if (text == shown_) {
    return;
  }
  shown_ = text;
  const RobotPhase phase = machine_.phase();
  const bool error = phase == RobotPhase::kFault || phase == RobotPhase::kOffline;
  const bool idle = phase == RobotPhase::kReady || phase == RobotPhase::kHoming;
  monitor_.SetState(error  ? ServiceState::kError
                    : idle ? ServiceState::kReady
                           : ServiceState::kWorking,
                    text);
}

void RobotService::Note(const Status& status) {
  if (!status.ok()) {
    monitor_.ReportError(status.error());
  }
}

}  // namespace forgescan
