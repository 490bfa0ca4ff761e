#include "tools/forgescan/station/state_table.h"

#include <fmt/format.h>

#include <algorithm>

#include "services/common/bus/channels.h"
#include "services/common/bus/stream_hub.h"

namespace forgescan {
namespace {

using State = fsmsg::service_state_t;
constexpr std::int64_t kSilentAfterUs = 3'000'000;
constexpr std::int64_t kRateWindowUs = 5'000'000;
constexpr std::size_t kSessionsLeftKept = 8;
constexpr int kLeastWidth = 96;

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

std::string Painted(const Look& look, bool colour) {
  return colour ? fmt::format("\x1b[{}m{:<9}\x1b[0m", look.colour, look.text)
                : fmt::format("{:<9}", look.text);
}

template <typename Number>
std::string Shown(const std::optional<Number>& number, const char* format) {
  return number.has_value() ? fmt::format(fmt::runtime(format), *number) : std::string("-");
}

std::int64_t CounterOf(const State& state, const std::string& name) {
  for (const auto& counter : state.counters) {
    if (counter.name == name) {
      return counter.value;
    }
  }
  return 0;
}

}  // namespace

StateTable::StateTable(Bus& bus) : bus_(bus) {
  SubscribeState<State>(bus_, kServiceState, [this](const State& state) { OnState(state); });
}

// A service that was started anew has another session, maybe a lower one if the clock was set back.
void StateTable::OnState(const State& state) {
  std::deque<std::int64_t>& left = left_[state.name];
  if (std::find(left.begin(), left.end(), state.session) != left.end()) {
    return;
  }
  std::deque<Sums>& sums = sums_[state.name];
  if (const auto found = states_.find(state.name);
      found != states_.end() && found->second.session != state.session) {
    left.push_back(found->second.session);
    sums.clear();
    if (left.size() > kSessionsLeftKept) {
      left.pop_front();
    }
  }
  states_[state.name] = state;
  sums.push_back({state.utime, CounterOf(state, "messages_received"), CounterOf(state, "messages_sent")});
  while (sums.front().utime < state.utime - kRateWindowUs) {
    sums.pop_front();
  }
}

bool StateTable::Silent(const State& state) const { return AgeUs(state) > kSilentAfterUs; }

bool StateTable::AllReady(const std::vector<std::string>& services) const {
  return std::all_of(services.begin(), services.end(), [this](const std::string& name) {
    const auto found = states_.find(name);
    return found != states_.end() && !Silent(found->second) &&
           (found->second.state == State::STATE_READY || found->second.state == State::STATE_WORKING);
  });
}

StateTable::Rates StateTable::RatesOf(const std::string& service) const {
  const auto found = sums_.find(service);
  if (found == sums_.end() || found->second.size() < 2) {
    return {};
  }
  const Sums &first = found->second.front(), &last = found->second.back();
  const double passed_s = static_cast<double>(last.utime - first.utime) * 1e-6;
  if (passed_s < 0.5) {  // two words at a change of state say nothing
    return {};
  }
  return {static_cast<double>(last.in - first.in) / passed_s,
          static_cast<double>(last.out - first.out) / passed_s};
}

std::string StateTable::Line(const TableRow& row, std::size_t rest, bool colour) const {
  const auto found = states_.find(row.service);
  const State* state = found == states_.end() ? nullptr : &found->second;
  const Look look = row.given_up       ? Look{"GIVEN UP", "31"}
                    : state == nullptr ? Look{"not heard", "31"}
                                       : LookOf(*state, Silent(*state));
  const auto cpu = row.usage ? row.usage->cpu_percent : std::nullopt;
  const auto memory = row.usage ? std::optional(row.usage->memory_mb) : std::nullopt;
  const auto peak = row.usage ? std::optional(row.usage->peak_memory_mb) : std::nullopt;
  const Rates rates = RatesOf(row.service);
  std::string line =
      fmt::format("{:<15}{} {:>5} {:>5} {:>5} {:>5} {:>5} {:>5}", row.service, Painted(look, colour),
                  state ? fmt::format("{:.1f}", static_cast<double>(AgeUs(*state)) * 1e-6) : "-",
                  Shown(cpu, "{:.0f}"), Shown(memory, "{:.0f}"), Shown(peak, "{:.0f}"),
                  Shown(rates.in_per_s, "{:.1f}"), Shown(rates.out_per_s, "{:.1f}"));
  if (state == nullptr) {
    line += fmt::format(" {:>5} {:>6} {:>6} {:>5}", "-", "-", "-", Shown(row.restarts, "{}"));
    return line + "\n";
  }
  line += fmt::format(" {:>5} {:>6} {:>6} {:>5}  ", state->messages_missing, state->messages_resent,
                      state->messages_recovered, Shown(row.restarts, "{}"));
  return line + Cut(state->text, rest) + "\n";
}

std::string StateTable::Render(const std::vector<TableRow>& rows, int width, bool colour) const {
  const std::string head = fmt::format(
      "{:<15}{:<9} {:>5} {:>5} {:>5} {:>5} {:>5} {:>5} {:>5} {:>6} {:>6} {:>5}  ", "service", "state",
      "age s", "cpu %", "MB", "peak", "in/s", "out/s", "gaps", "resent", "recov.", "rest.");
  const auto columns = static_cast<std::size_t>(std::max(kLeastWidth, width));
  const std::size_t rest = columns > head.size() ? columns - head.size() : 0;
  std::string table = Cut(head + "doing", columns) + "\n", errors;
  for (const TableRow& row : rows) {
    table += Line(row, rest, colour);
    const auto found = states_.find(row.service);
    if (found != states_.end() && !found->second.last_error.empty()) {
      errors += Cut(fmt::format("{}: {}", row.service, found->second.last_error), columns) + "\n";
    }
  }
  return errors.empty() ? table : table + "last errors\n" + errors;
}

}  // namespace forgescan
