#include "tools/forgescan/station/station_runner.h"

#include <fmt/ranges.h>

#include <algorithm>
#include <csignal>
#include <filesystem>

#include "services/common/bus/channels.h"
#include "services/common/bus/stream_hub.h"
#include "tools/forgescan/station/leftovers.h"

namespace forgescan {
namespace {

using State = fsmsg::service_state_t;
constexpr std::int64_t kStepUs = 20'000;  // how soon a dead process is noticed

std::string LogFolder(const std::string& folder) { return (std::filesystem::path(folder) / "log").string(); }

std::vector<Supervisor::Member> Members(const Station& station) {
  std::vector<Supervisor::Member> members;
  for (const StationService& service : StationServices(station)) {
    members.push_back({service.name, service.stage});
  }
  return members;
}

std::vector<std::string> CommandOf(const std::string& name, const Station& station) {
  for (const StationService& service : StationServices(station)) {
    if (service.name == name) {
      std::vector<std::string> command{ProgramFolder() + "/" + service.program};
      command.insert(command.end(), service.arguments.begin(), service.arguments.end());
      command.insert(command.end(), {"--station", station.folder});
      return command;
    }
  }
  return {name};
}

// Longer than any stop in order: every service at the end of its patience, and then killed.
double LongestStopS(const Station& station, const SupervisionPolicy& policy) {
  constexpr double kMarginS = 30;
  double sum_s = policy.drain_s + kMarginS;
  for (const StationService& service : StationServices(station)) {
    sum_s += policy.StopPatienceS(service.name);
  }
  return sum_s;
}

ServiceWord WordOf(const State& state) {
  return {.service = state.name,
          .session = state.session,
          .starting = state.state == State::STATE_STARTING,
          .ready = state.state == State::STATE_READY || state.state == State::STATE_WORKING,
          .age_us = state.utime - state.session};
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
      supervisor_(policy_, Members(station_)),
      processes_(LogFolder(station_.folder)) {
  for (const StationService& service : StationServices(station_)) {
    names_.push_back(service.name);
  }
  SubscribeState<State>(*bus_, kServiceState, [this](const State& state) {
    Carry(supervisor_.OnWord(WordOf(state), bus_->NowUs()));
  });
}

Result<std::unique_ptr<StationRunner>> StationRunner::Create(const std::string& folder, Echo echo) {
  ASSIGN_OR_RETURN(Station station, Station::Load(folder));
  ASSIGN_OR_RETURN(SupervisionPolicy policy, SupervisionPolicy::Load(station.file));
  ASSIGN_OR_RETURN(StationLock lock, StationLock::Take(folder, LongestStopS(station, policy)));
  ASSIGN_OR_RETURN(SupervisorLog log, SupervisorLog::Open(LogFolder(folder), echo));
  if (!lock.named().ok()) {
    log.Write("station", lock.named().error().message, true);
  }
  RETURN_IF_ERROR(EndLeftovers(lock.left_behind(), policy, log));
  lock.LeftBehindHaveEnded();
  std::signal(SIGPIPE, SIG_IGN);  // nobody reads the output any more: no reason to leave the services alone
  ASSIGN_OR_RETURN(auto bus, LcmBus::Open(station.bus_url));
  return std::unique_ptr<StationRunner>(
      new StationRunner({std::move(station), policy, std::move(lock), std::move(log), std::move(bus)}));
}

// Stops at the action that shows that the station cannot work: no further service is started then.
void StationRunner::Carry(const Supervisor::Actions& actions) {
  const bool refused = !supervisor_.refused().empty();
  for (const SupervisorAction& action : actions) {
    std::visit([this](const auto& one) { Do(one); }, action);
    if (!refused && !supervisor_.refused().empty()) {
      return;
    }
  }
}

void StationRunner::Do(const StartProcess& start) {
  const Status started = processes_.Start(start.service, CommandOf(start.service, station_));
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

ServiceProcesses StationRunner::Processes() const {
  ServiceProcesses processes;
  for (const std::string& name : names_) {
    processes[name] = {processes_.IdOf(name), supervisor_.restarts(name),
                       supervisor_.phase(name) == Supervisor::Phase::kGivenUp};
  }
  return processes;
}

// A full disk is told once, but ends no station; it is tried again until there is room.
void StationRunner::NoteProcesses() {
  ServiceProcesses now = Processes();
  if (now == noted_) {
    return;
  }
  const Status written = lock_.Write(now);
  if (written.ok()) {
    noted_ = std::move(now);
  } else if (!note_failed_) {
    log_.Write("station", written.error().message, true);
  }
  note_failed_ = !written.ok();
}

Status StationRunner::Step() {
  while (const auto end = processes_.Ended()) {
    Carry(supervisor_.OnEnd(*end, bus_->NowUs()));
  }
  Carry(supervisor_.OnTick(bus_->NowUs()));
  NoteProcesses();
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
  const double patience_s = policy_.StopPatienceS(name);
  processes_.Signal(name, SIGTERM);
  if (WaitFor(patience_s, [&] { return HasStopped(name); })) {
    return;
  }
  log_.Write(name, fmt::format("has not stopped within {} s: KILLED", patience_s), true);
  processes_.Signal(name, SIGKILL);
  stop_faults_.push_back(name + " had to be killed to stop");
  WaitFor(patience_s, [&] { return processes_.EndOf(name).has_value(); });
}

bool StationRunner::HasStopped(const std::string& name) {
  const auto end = processes_.EndOf(name);
  if (!end.has_value()) {
    return false;
  }
  const bool in_order = end->by_itself ? end->code == 0 : end->code == SIGTERM;  // as it was just started
  if (!in_order) {
    log_.Write(name, end->Text(), true);
    stop_faults_.push_back(name + " " + end->Text());
  }
  return true;
}

void StationRunner::StopStage(StationStage stage) {
  const std::vector<StationService> services = StationServices(station_);
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
  log_.Write("station", fmt::format("is down, {} restarts{}", restarts(),
                                    supervisor_.given_up().empty() ? "" : ", DEGRADED"));
  Status outcome = StopOutcome();
  if (const Status told = lock_.WriteOutcome(outcome); !told.ok()) {
    log_.Write("station", told.error().message, true);
  }
  return outcome;
}

Status StationRunner::StopOutcome() const {
  std::vector<std::string> faults;
  for (const std::string& name : supervisor_.given_up()) {
    faults.push_back(name + " was given up");
  }
  faults.insert(faults.end(), stop_faults_.begin(), stop_faults_.end());
  return faults.empty()
             ? Status()
             : Fail(ErrorCode::kUnavailable, "station {}: {}", station_.name, fmt::join(faults, "; "));
}

}  // namespace forgescan
