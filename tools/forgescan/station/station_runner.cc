#include "tools/forgescan/station/station_runner.h"

#include <fmt/ranges.h>

#include <algorithm>
#include <csignal>
#include <filesystem>

#include "services/common/bus/channels.h"
#include "services/common/bus/stream_hub.h"

namespace forgescan {
namespace {

using State = fsmsg::service_state_t;
constexpr std::int64_t kStepUs = 20'000;  // how soon a dead process is noticed

std::string LogFolder(const std::string& folder) { return (std::filesystem::path(folder) / "log").string(); }

std::vector<Supervisor::Member> Members() {
  std::vector<Supervisor::Member> members;
  for (const StationService& service : StationServices()) {
    members.push_back({service.name, service.stage});
  }
  return members;
}

std::vector<std::string> CommandOf(const std::string& name, const std::string& folder) {
  for (const StationService& service : StationServices()) {
    if (service.name == name) {
      std::vector<std::string> command{ProgramFolder() + "/" + service.program};
      command.insert(command.end(), service.arguments.begin(), service.arguments.end());
      command.insert(command.end(), {"--station", folder});
      return command;
    }
  }
  return {name};
}

ServiceWord WordOf(const State& state) {
  return {.service = state.name,
          .session = state.session,
          .starting = state.state == State::STATE_STARTING,
          .ready = state.state == State::STATE_READY || state.state == State::STATE_WORKING};
}

}  // namespace

std::string ProgramFolder() { return std::filesystem::read_symlink("/proc/self/exe").parent_path().string(); }

StationRunner::StationRunner(Parts parts)
    : station_(std::move(parts.station)),
      policy_(parts.policy),
      lock_(std::move(parts.lock)),
      log_(std::move(parts.log)),
      bus_(std::move(parts.bus)),
      table_(*bus_),
      supervisor_(policy_, Members()),
      processes_(LogFolder(station_.folder)) {
  for (const StationService& service : StationServices()) {
    names_.push_back(service.name);
  }
  SubscribeState<State>(*bus_, kServiceState, [this](const State& state) {
    Carry(supervisor_.OnWord(WordOf(state), bus_->NowUs()));
  });
}

Result<std::unique_ptr<StationRunner>> StationRunner::Create(const std::string& folder, Echo echo) {
  ASSIGN_OR_RETURN(Station station, Station::Load(folder));
  ASSIGN_OR_RETURN(SupervisionPolicy policy, SupervisionPolicy::Load(station.file.Table("supervision")));
  ASSIGN_OR_RETURN(StationLock lock, StationLock::Take(folder));
  ASSIGN_OR_RETURN(SupervisorLog log, SupervisorLog::Open(LogFolder(folder), echo));
  ASSIGN_OR_RETURN(auto bus, LcmBus::Open(station.bus_url));
  return std::unique_ptr<StationRunner>(
      new StationRunner({std::move(station), policy, std::move(lock), std::move(log), std::move(bus)}));
}

void StationRunner::Carry(const Supervisor::Actions& actions) {
  for (const SupervisorAction& action : actions) {
    std::visit([this](const auto& one) { Do(one); }, action);
  }
}

void StationRunner::Do(const StartProcess& start) {
  const Status started = processes_.Start(start.service, CommandOf(start.service, station_.folder));
  if (!started.ok()) {
    constexpr int kNoProgram = 127;  // as a shell would say
    Carry(supervisor_.OnEnd({start.service, true, kNoProgram, started.error().message}, bus_->NowUs()));
  }
}

void StationRunner::Do(const KillProcess& kill) { processes_.Signal(kill.service, SIGKILL); }

void StationRunner::Do(const SupervisorEvent& event) {
  using Kind = SupervisorEvent::Kind;
  const bool after_restart = event.kind == Kind::kReady && supervisor_.restarts(event.service) > 0;
  const bool usual = event.kind == Kind::kStart || event.kind == Kind::kReady;
  log_.Write(event.service, event.text, !usual || after_restart);
}

std::map<std::string, ServiceProcess> StationRunner::Processes() const {
  std::map<std::string, ServiceProcess> processes;
  for (const std::string& name : names_) {
    processes[name] = {processes_.PidOf(name), supervisor_.restarts(name)};
  }
  return processes;
}

Status StationRunner::Step() {
  const auto before = Processes();
  while (const auto end = processes_.Ended()) {
    Carry(supervisor_.OnEnd(*end, bus_->NowUs()));
  }
  Carry(supervisor_.OnTick(bus_->NowUs()));
  if (Processes() != before) {
    RETURN_IF_ERROR(lock_.Write(Processes()));
  }
  if (!supervisor_.refused().empty()) {
    return Fail(ErrorCode::kUnavailable, "station {}: {}", station_.name, supervisor_.refused());
  }
  if (const auto lost = supervisor_.given_up(); !lost.empty() && !policy_.keep_running) {
    return Fail(ErrorCode::kUnavailable, "station {} stops, as {} was given up ([supervision] keep_running)",
                station_.name, fmt::join(lost, ", "));
  }
  return {};
}

Status StationRunner::RunFor(std::int64_t duration_us) {
  const std::int64_t until_us = bus_->NowUs() + duration_us;
  do {
    RETURN_IF_ERROR(bus_->RunOnce(std::clamp<std::int64_t>(until_us - bus_->NowUs(), 0, kStepUs)));
    RETURN_IF_ERROR(Step());
  } while (bus_->NowUs() < until_us);
  return {};
}

Status StationRunner::WaitUntilReady(std::int64_t patience_us) {
  const std::int64_t until_us = bus_->NowUs() + patience_us;
  while (!AllReady()) {
    if (bus_->NowUs() > until_us) {
      return Fail(ErrorCode::kUnavailable, "station {} is not ready after {} s:\n{}", station_.name,
                  patience_us / 1'000'000, Table(160, false));
    }
    RETURN_IF_ERROR(RunFor(100'000));
  }
  return {};
}

std::vector<TableRow> StationRunner::Rows() {
  std::vector<TableRow> rows;
  for (const auto& name : names_) {
    rows.push_back({.service = name,
                    .usage = usage_.Of(processes_.PidOf(name), bus_->NowUs()),
                    .restarts = supervisor_.restarts(name),
                    .given_up = supervisor_.phase(name) == Supervisor::Phase::kGivenUp});
  }
  return rows;
}

template <typename Condition>
bool StationRunner::WaitFor(double patience_s, const Condition& condition) {
  const std::int64_t until_us = bus_->NowUs() + static_cast<std::int64_t>(patience_s * 1e6);
  while (!condition()) {
    const bool heard = bus_->NowUs() < until_us && bus_->RunOnce(kStepUs).ok();
    if (!heard) {
      return condition();
    }
  }
  return true;
}

void StationRunner::StopOne(const std::string& name) {
  const double patience_s = policy_.StopPatience(name);
  processes_.Signal(name, SIGTERM);
  if (WaitFor(patience_s, [&] { return processes_.Reaped(name); })) {
    return;
  }
  log_.Write(name, fmt::format("has not stopped within {} s: KILLED", patience_s), true);
  processes_.Signal(name, SIGKILL);
  killed_.push_back(name);
  WaitFor(policy_.stop_patience_s, [&] { return processes_.Reaped(name); });
}

void StationRunner::StopStage(StationStage stage) {
  const std::vector<StationService> services = StationServices();
  for (auto service = services.rbegin(); service != services.rend(); ++service) {
    if (service->stage == stage && processes_.PidOf(service->name) != 0) {
      StopOne(service->name);
    }
  }
}

// The report says READY when no part is in work, so every stage before it is empty then, too.
void StationRunner::Drain() {
  const auto drained = [this] {
    const auto report = table_.states().find("report");
    return processes_.PidOf("report") == 0 || report == table_.states().end() ||
           report->second.state == State::STATE_READY;
  };
  if (!WaitFor(policy_.drain_s, drained)) {
    log_.Write(
        "station",
        fmt::format("parts are still in work after {} s: they end without a measurement", policy_.drain_s),
        true);
  }
}

Status StationRunner::Stop() {
  log_.Write("station", "is stopped");
  StopStage(kMoving);
  StopStage(kSensing);
  Drain();
  StopStage(kComputing);
  StopStage(kRecording);
  const auto lost = supervisor_.given_up();
  log_.Write("station", fmt::format("is down, {} restarts{}", restarts(), lost.empty() ? "" : ", DEGRADED"));
  if (!lost.empty()) {
    return Fail(ErrorCode::kUnavailable, "station {} ran degraded: {} was given up", station_.name,
                fmt::join(lost, ", "));
  }
  if (!killed_.empty()) {
    return Fail(ErrorCode::kUnavailable, "station {}: {} had to be killed to stop", station_.name,
                fmt::join(killed_, ", "));
  }
  return {};
}

}  // namespace forgescan
