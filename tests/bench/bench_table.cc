// bench_table GOALS.toml RESULT.json...: one table of all benches, each implementation's time over ours,
// against the goals. Exit code 1 if a goal is missed or a benchmark failed; a peer that was not built is
// named and misses nothing.
#include <fmt/format.h>
#include <toml++/toml.h>

#include <algorithm>
#include <cstdio>
#include <exception>
#include <fstream>
#include <iterator>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <regex>
#include <stdexcept>
#include <string>
#include <vector>

namespace {

struct Row {
  std::string who;  // the name behind the step
  double time_ms = 0;
  double spread = 0;  // standard deviation over mean of the repetitions
  std::string counters;
  std::string error;
};

struct Goal {
  std::string step;
  std::string peer;
  double ratio = 0;
};

using Steps = std::map<std::string, std::vector<Row>>;

double Milliseconds(double time, const std::string& unit) {
  if (unit == "ns") return time * 1e-6;
  if (unit == "us") return time * 1e-3;
  if (unit == "ms") return time;
  if (unit == "s") return time * 1e3;
  throw std::runtime_error("unknown time unit " + unit);
}

// What Google Benchmark writes beside an entry's own keys are the bench's counters.
std::string Counters(const nlohmann::json& entry) {
  static const std::vector<std::string> known = {"name",       "family_index",    "per_family_instance_index",
                                                 "run_name",   "run_type",        "repetitions",
                                                 "threads",    "aggregate_name",  "aggregate_unit",
                                                 "iterations", "real_time",       "cpu_time",
                                                 "time_unit",  "error_occurred",  "error_message",
                                                 "label",      "repetition_index"};
  std::string text;
  for (const auto& [key, value] : entry.items()) {
    if (value.is_number() && std::find(known.begin(), known.end(), key) == known.end()) {
      text += fmt::format("{}{} {:.4g}", text.empty() ? "" : ", ", key, value.get<double>());
    }
  }
  return text;
}

// "decode/ours/threads:2/real_time" -> step "decode", who "ours/threads:2".
std::pair<std::string, std::string> Split(std::string name) {
  const std::string clock = "/real_time";
  if (name.ends_with(clock)) name.resize(name.size() - clock.size());
  for (const char* setting : {"/iterations:", "/repeats:"})
    name.resize(std::min(name.size(), name.find(setting)));
  const auto slash = name.find('/');
  if (slash == std::string::npos) throw std::runtime_error("benchmark " + name + " is not named STEP/WHO");
  return {name.substr(0, slash), name.substr(slash + 1)};
}

Row& RowOf(std::vector<Row>& rows, const std::string& who) {
  const auto found = std::find_if(rows.begin(), rows.end(), [&](const Row& row) { return row.who == who; });
  if (found != rows.end()) return *found;
  rows.emplace_back().who = who;
  return rows.back();
}

void Read(const std::string& path, Steps& steps) {
  std::ifstream stream(path);
  if (!stream) throw std::runtime_error(path + " cannot be read");
  const std::string text{std::istreambuf_iterator<char>(stream), {}};
  // Google Benchmark writes the spread of a counter that is always 0 as NaN, which is no JSON.
  const nlohmann::json results =
      nlohmann::json::parse(std::regex_replace(text, std::regex("-?(NaN|Infinity)"), "null"));
  for (const auto& entry : results.at("benchmarks")) {
    const auto [step, who] = Split(entry.at("run_name"));
    Row& row = RowOf(steps[step], who);
    if (entry.value("error_occurred", false)) {
      row.error = entry.value("error_message", "failed");
    } else if (entry.value("aggregate_name", "") == "median") {
      row.time_ms = Milliseconds(entry.at("real_time"), entry.at("time_unit"));
      row.counters = Counters(entry);
    } else if (entry.value("aggregate_name", "") == "cv") {
      row.spread = entry.at("real_time");
    }
  }
}

std::vector<Goal> ReadGoals(const std::string& path) {
  std::vector<Goal> goals;
  const toml::table file = toml::parse_file(path);
  const toml::array* tables = file["goal"].as_array();
  if (tables == nullptr) throw std::runtime_error(path + " has no [[goal]]");
  for (const toml::node& node : *tables) {
    const toml::table& table = *node.as_table();
    goals.push_back({table["step"].value<std::string>().value(), table["peer"].value<std::string>().value(),
                     table["ratio"].value<double>().value()});
  }
  return goals;
}

std::optional<Row> Find(const Steps& steps, const std::string& step, const std::string& who) {
  const auto rows = steps.find(step);
  if (rows == steps.end()) return std::nullopt;
  for (const Row& row : rows->second) {
    if (row.who == who) return row;
  }
  return std::nullopt;
}

std::string Verdict(const Goal& goal, double ratio) {
  return fmt::format("goal {:.0f}: {}", goal.ratio, ratio >= goal.ratio ? "met" : "MISSED");
}

bool PrintStep(const Steps& steps, const std::string& step, const std::vector<Goal>& goals) {
  const auto ours = Find(steps, step, "ours");
  const bool comparable = ours.has_value() && ours->error.empty();
  bool good = true;
  for (const Row& row : steps.at(step)) {
    if (!row.error.empty()) {
      fmt::print("{:<14} {:<18} FAILED: {}\n", step, row.who, row.error);
      good = false;
      continue;
    }
    const double ratio = comparable ? row.time_ms / ours->time_ms : 0;
    const auto goal = std::find_if(goals.begin(), goals.end(),
                                   [&](const Goal& g) { return g.step == step && g.peer == row.who; });
    const std::string verdict = goal != goals.end() ? Verdict(*goal, ratio) : "";
    good = good && (goal == goals.end() || ratio >= goal->ratio);
    fmt::print("{:<14} {:<18} {:>11.3f} {:>6.1f} {:>9.2f}  {:<16} {}\n", step, row.who, row.time_ms,
               100 * row.spread, ratio, verdict, row.counters);
  }
  return good;
}

int Run(int argc, char** argv) {
  if (argc < 3) throw std::runtime_error("usage: bench_table GOALS.toml RESULT.json...");
  const std::vector<Goal> goals = ReadGoals(argv[1]);
  Steps steps;
  for (int i = 2; i < argc; ++i) Read(argv[i], steps);
  bool good = true;
  fmt::print("{:<14} {:<18} {:>11} {:>6} {:>9}\n", "step", "who", "median ms", "cv %", "of ours");
  for (const auto& [step, rows] : steps) good = PrintStep(steps, step, goals) && good;
  for (const Goal& goal : goals) {
    if (!Find(steps, goal.step, goal.peer))
      fmt::print("{:<14} {:<18} was not run or not built\n", goal.step, goal.peer);
  }
  return good ? 0 : 1;
}

}  // namespace

int main(int argc, char** argv) {
  try {
    return Run(argc, argv);
  } catch (const std::exception& error) {
    fmt::print(stderr, "bench_table: {}\n", error.what());
    return 2;
  }
}
