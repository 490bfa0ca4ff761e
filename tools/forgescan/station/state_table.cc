#include "tools/forgescan/station/state_table.h"

#include <fmt/format.h>

#include <algorithm>

#include "services/common/bus/channels.h"
#include "services/common/bus/stream_hub.h"

namespace forgescan {
namespace {

using State = fsmsg::service_state_t;
constexpr std::int64_t kSilentAfterUs = 3'000'000;

struct Look {
  const char* text;
  const char* colour;
};

Look LookOf(const State& state, bool silent) {
  if (silent) {
    return {"SILENT", "31"};
  }
  switch (state.state) {
    case State::STATE_STARTING:
      return {"starting", "33"};
    case State::STATE_READY:
      return {"ready", "32"};
    case State::STATE_WORKING:
      return {"working", "36"};
    case State::STATE_DEGRADED:
      return {"degraded", "33"};
    case State::STATE_ERROR:
      return {"ERROR", "31"};
    case State::STATE_STOPPING:
      return {"stopping", "33"};
    default:
      return {"unknown", "31"};
  }
}

std::string Cut(const std::string& text, std::size_t width) {
  return text.size() <= width ? text : text.substr(0, width > 1 ? width - 1 : 0) + "~";
}

}  // namespace

StateTable::StateTable(Bus& bus) : bus_(bus) {
  SubscribeState<State>(bus_, kServiceState, [this](const State& state) {
    const auto found = states_.find(state.name);
    if (found == states_.end() || state.session >= found->second.session) {
      states_[state.name] = state;
    }
  });
}

bool StateTable::AllReady(const std::vector<std::string>& services) const {
  return std::all_of(services.begin(), services.end(), [this](const std::string& name) {
    const auto found = states_.find(name);
    return found != states_.end() &&
           (found->second.state == State::STATE_READY || found->second.state == State::STATE_WORKING);
  });
}

std::string StateTable::Render(const std::vector<std::string>& services, int width, bool colour) const {
  constexpr int kColumns = 15 + 10 + 7 + 9 + 9 + 9 + 8;
  const auto rest = static_cast<std::size_t>(std::max(20, width - kColumns));
  std::string table = fmt::format("{:<15}{:<10}{:>6} {:>8} {:>8} {:>8} {:>7}  {}\n", "service", "state",
                                  "age s", "missing", "resent", "recov'd", "drops", "what");
  for (const std::string& name : services) {
    const auto found = states_.find(name);
    if (found == states_.end()) {
      table += fmt::format("{:<15}{:<10}\n", name, "not heard");
      continue;
    }
    const State& state = found->second;
    const std::int64_t age_us = bus_.NowUs() - state.utime;
    const Look look = LookOf(state, age_us > kSilentAfterUs);
    const std::string shown = colour ? fmt::format("\x1b[{}m{:<10}\x1b[0m", look.colour, look.text)
                                     : fmt::format("{:<10}", look.text);
    const std::string what = state.last_error.empty()
                                 ? state.text
                                 : fmt::format("{} | last error: {}", state.text, state.last_error);
    table += fmt::format("{:<15}{}{:>6.1f} {:>8} {:>8} {:>8} {:>7}  {}\n", name, shown,
                         static_cast<double>(age_us) * 1e-6, state.messages_missing, state.messages_resent,
                         state.messages_recovered, state.socket_drops, Cut(what, rest));
  }
  return table;
}

}  // namespace forgescan
