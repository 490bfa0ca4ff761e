// Keeps the services of a station running. Pure: events with their time in, actions out; who starts and kills
// processes is the StationRunner.
//
//   waiting --its stage is due, or its back-off over--> running --process ended--> waiting (back-off)
//                                                          |                  \--> given up: too often
//                                                          +--silent--> killed --process ended--> as above
//
// Stages start one after the other: the next when every service of this one has said more than STARTING, has
// been given up, or when patience is over.
//
// A service that ends with an exit code other than 0 before it was ever ready cannot work with this station
// file: the station is refused, as starting it again would change nothing, and nothing is started any more.
#pragma once

#include <cstdint>
#include <deque>
#include <map>
#include <string>
#include <variant>
#include <vector>

#include "tools/forgescan/station/supervision_policy.h"

namespace forgescan {

struct StartProcess {
  std::string service;
};
struct KillProcess {
  std::string service;
};
// Worth a line in supervisor.log.
struct SupervisorEvent {
  enum class Kind { kStart, kReady, kCrash, kSilent, kRestart, kGivenUp, kRefused };
  Kind kind;
  std::string service;
  std::string text;  // one sentence without the service's name
};
using SupervisorAction = std::variant<StartProcess, KillProcess, SupervisorEvent>;

// How a process ended.
struct ProcessEnd {
  std::string service;
  bool by_itself = false;  // exit code; otherwise a signal
  int code = 0;            // exit code, or number of the signal
  std::string last_words;  // of its log
  std::string Text() const;
};

// What a service said on SERVICE_STATE.
struct ServiceWord {
  std::string service;
  std::int64_t session = 0;  // of the process that speaks
  bool starting = false;     // has not said more than STARTING
  bool ready = false;        // READY or WORKING
  std::int64_t age_us = 0;   // of that process when it spoke, by its own clock
};

class Supervisor {
 public:
  using Actions = std::vector<SupervisorAction>;
  enum class Phase { kWaiting, kRunning, kKilled, kGivenUp };
  struct Member {
    std::string service;
    int stage = 0;
  };

  // `members` in the order of starting, their stages ascending.
  Supervisor(const SupervisionPolicy& policy, const std::vector<Member>& members);

  Actions OnTick(std::int64_t now_us);
  // Words of a session heard before, or of a process older than the last start, are another's: of one that
  // ended, or of one that nobody here has started. Ages are compared and no times of day: a service that was
  // started after the computer's clock was set has another one than the supervisor.
  Actions OnWord(const ServiceWord& word, std::int64_t now_us);
  Actions OnEnd(const ProcessEnd& end, std::int64_t now_us);

  Phase phase(const std::string& service) const { return services_.at(service).phase; }
  int restarts(const std::string& service) const { return services_.at(service).restarts; }
  int restarts() const;
  // Names of those given up, in the order of starting.
  std::vector<std::string> given_up() const;
  // Not empty: the station cannot work, why.
  const std::string& refused() const { return refused_; }

 private:
  struct Service {
    int stage = 0;
    Phase phase = Phase::kWaiting;
    std::int64_t due_us = 0;         // waiting: when it is started, once its stage is due
    std::int64_t started_us = 0;     // the last time
    std::int64_t heard_us = 0;       // running: its last word, or its start
    std::int64_t ended_us = 0;       // 0: never
    std::int64_t session = 0;        // of its last word
    std::deque<std::int64_t> ended;  // sessions, the last ones: their words may come after the end
    bool starting = true;
    bool ready = false;
    bool was_ready = false;  // ever
    bool was_started = false;
    int restarts = 0;
    std::deque<std::int64_t> failures_us;  // in the window
  };
  void AdvanceStage(std::int64_t now_us);
  void Start(const std::string& name, Service& service, std::int64_t now_us, Actions& actions);
  void CheckSilence(const std::string& name, Service& service, std::int64_t now_us, Actions& actions);
  static void Forget(Service& service, std::int64_t session);
  static bool IsAnothers(const Service& service, const ServiceWord& word, std::int64_t now_us);
  std::int64_t BackoffUs(std::size_t failures) const;

  SupervisionPolicy policy_;
  std::vector<std::string> order_;
  std::map<std::string, Service> services_;
  int stage_ = 0;
  std::int64_t stage_since_us_ = 0;  // 0: not begun
  std::string refused_;
};

}  // namespace forgescan
