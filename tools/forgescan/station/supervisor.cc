#include "tools/forgescan/station/supervisor.h"

#include <fmt/format.h>

#include <algorithm>

namespace forgescan {
namespace {

using Kind = SupervisorEvent::Kind;

constexpr std::size_t kSessionsEndedKept = 8;

std::int64_t ToUs(double seconds) { return static_cast<std::int64_t>(seconds * 1e6); }
double ToSeconds(std::int64_t us) { return static_cast<double>(us) * 1e-6; }

}  // namespace

std::string ProcessEnd::Text() const {
  const std::string fate =
      by_itself ? fmt::format("ended with exit code {}", code) : fmt::format("was killed by signal {}", code);
  return last_words.empty() ? fate : fate + ": " + last_words;
}

Supervisor::Supervisor(const SupervisionPolicy& policy, const std::vector<Member>& members)
    : policy_(policy) {
  for (const Member& member : members) {
    order_.push_back(member.service);
    services_[member.service].stage = member.stage;
  }
  stage_ = members.empty() ? 0 : members.front().stage;
}

int Supervisor::restarts() const {
  int sum = 0;
  for (const auto& [name, service] : services_) {
    sum += service.restarts;
  }
  return sum;
}

std::vector<std::string> Supervisor::given_up() const {
  std::vector<std::string> names;
  std::copy_if(order_.begin(), order_.end(), std::back_inserter(names),
               [this](const std::string& name) { return phase(name) == Phase::kGivenUp; });
  return names;
}

void Supervisor::AdvanceStage(std::int64_t now_us) {
  stage_since_us_ = stage_since_us_ == 0 ? now_us : stage_since_us_;
  const bool all_up = std::all_of(services_.begin(), services_.end(), [this](const auto& entry) {
    const Service& service = entry.second;
    const bool up = service.phase == Phase::kRunning && !service.starting;
    return service.stage != stage_ || up || service.phase == Phase::kGivenUp;
  });
  if (!all_up && now_us - stage_since_us_ < ToUs(policy_.stage_patience_s)) {
    return;
  }
  for (const std::string& name : order_) {  // the next stage, if there is one
    if (const int stage = services_.at(name).stage; stage > stage_) {
      stage_ = stage;
      stage_since_us_ = now_us;
      return;
    }
  }
}

Supervisor::Actions Supervisor::OnTick(std::int64_t now_us) {
  Actions actions;
  AdvanceStage(now_us);
  for (const std::string& name : order_) {
    Service& service = services_.at(name);
    if (service.phase == Phase::kRunning) {
      CheckSilence(name, service, now_us, actions);
    } else if (refused_.empty() && service.phase == Phase::kWaiting && service.stage <= stage_ &&
               now_us >= service.due_us) {
      Start(name, service, now_us, actions);
    }
  }
  return actions;
}

void Supervisor::Start(const std::string& name, Service& service, std::int64_t now_us, Actions& actions) {
  service.phase = Phase::kRunning;
  service.started_us = service.heard_us = now_us;
  service.starting = true;
  service.ready = false;
  if (service.was_started) {
    ++service.restarts;
    actions.emplace_back(
        SupervisorEvent{Kind::kRestart, name, fmt::format("is started again, restart {}", service.restarts)});
  } else {
    actions.emplace_back(SupervisorEvent{Kind::kStart, name, "is started"});
  }
  service.was_started = true;
  actions.emplace_back(StartProcess{name});
}

void Supervisor::CheckSilence(const std::string& name, Service& service, std::int64_t now_us,
                              Actions& actions) {
  const double limit_s = service.starting ? policy_.start_patience_s : policy_.silence_s;
  const std::int64_t silent_us = now_us - service.heard_us;
  if (silent_us <= ToUs(limit_s)) {
    return;
  }
  service.phase = Phase::kKilled;
  actions.emplace_back(SupervisorEvent{
      Kind::kSilent, name,
      fmt::format("has been silent for {:.1f} s, {} s are allowed: killed", ToSeconds(silent_us), limit_s)});
  actions.emplace_back(KillProcess{name});
}

void Supervisor::Forget(Service& service, std::int64_t session) {
  if (std::find(service.ended.begin(), service.ended.end(), session) != service.ended.end()) {
    return;
  }
  service.ended.push_back(session);
  if (service.ended.size() > kSessionsEndedKept) {
    service.ended.pop_front();
  }
}

bool Supervisor::IsAnothers(const Service& service, const ServiceWord& word, std::int64_t now_us) {
  return word.age_us > now_us - service.started_us ||
         std::find(service.ended.begin(), service.ended.end(), word.session) != service.ended.end();
}

Supervisor::Actions Supervisor::OnWord(const ServiceWord& word, std::int64_t now_us) {
  const auto found = services_.find(word.service);
  if (found == services_.end()) {
    return {};
  }
  Service& service = found->second;
  if (service.phase != Phase::kRunning) {
    Forget(service, word.session);
    return {};
  }
  if (IsAnothers(service, word, now_us)) {
    return {};
  }
  service.heard_us = now_us;
  service.session = word.session;
  service.starting = service.starting && word.starting;
  if (!word.ready || service.ready) {
    return {};
  }
  service.ready = service.was_ready = true;
  const std::string after =
      service.ended_us == 0 ? ""
                            : fmt::format(", {:.2f} s after it ended", ToSeconds(now_us - service.ended_us));
  return {SupervisorEvent{Kind::kReady, word.service, "is ready" + after}};
}

std::int64_t Supervisor::BackoffUs(std::size_t failures) const {
  if (failures <= 1) {
    return 0;  // at once: a part may be saved
  }
  double wait_s = policy_.backoff_s;
  for (std::size_t i = 2; i < failures && wait_s < policy_.backoff_max_s; ++i) {
    wait_s *= 2;
  }
  return ToUs(std::min(wait_s, policy_.backoff_max_s));
}

Supervisor::Actions Supervisor::OnEnd(const ProcessEnd& end, std::int64_t now_us) {
  const auto found = services_.find(end.service);
  if (found == services_.end()) {
    return {};
  }
  Service& service = found->second;
  Actions actions{SupervisorEvent{Kind::kCrash, end.service, end.Text()}};
  service.ended_us = now_us;
  Forget(service, service.session);
  service.ready = false;
  service.failures_us.push_back(now_us);
  while (service.failures_us.front() < now_us - ToUs(policy_.restart_window_s)) {
    service.failures_us.pop_front();
  }
  const bool cannot_work = !service.was_ready && end.by_itself && end.code != 0;
  if (cannot_work) {
    service.phase = Phase::kGivenUp;
    refused_ = fmt::format("{} {}", end.service, end.Text());
    actions.emplace_back(SupervisorEvent{Kind::kRefused, end.service, "cannot work on this station"});
  } else if (service.failures_us.size() > static_cast<std::size_t>(policy_.restarts_max)) {
    service.phase = Phase::kGivenUp;
    actions.emplace_back(SupervisorEvent{
        Kind::kGivenUp, end.service,
        fmt::format("IS GIVEN UP: it ended {} times within {} s, {} restarts are allowed",
                    service.failures_us.size(), policy_.restart_window_s, policy_.restarts_max)});
  } else {
    service.phase = Phase::kWaiting;
    service.due_us = now_us + BackoffUs(service.failures_us.size());
  }
  return actions;
}

}  // namespace forgescan
