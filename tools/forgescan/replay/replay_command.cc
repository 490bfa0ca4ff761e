// forgescan replay LOG...
#include <fmt/ranges.h>
#include <spdlog/spdlog.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <filesystem>

#include "services/common/bus/channels.h"
#include "services/common/bus/codec.h"
#include "services/common/output_file.h"
#include "tools/forgescan/command.h"
#include "tools/forgescan/replay/message_text.h"
#include "tools/forgescan/replay/replay_run.h"
#include "tools/forgescan/replay/scratch_folder.h"
#include "tools/forgescan/replay/what_if.h"
#include "tools/forgescan/station/interrupt.h"

namespace forgescan {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kFieldsShown = 12;
constexpr std::size_t kFindingsShown = 10;

struct ReplayArguments {
  std::vector<std::string> logs;
  std::vector<std::string> services;
  StationChanges changes;
  int threads = 0;  // 0: as the station says
  std::string report;
  std::string results;
};

// One line on stderr that is written over again; nothing where stderr is no terminal.
class ProgressLine {
 public:
  void Show(double share) {
    const auto now = std::chrono::steady_clock::now();
    if (shown_ && now - last_ >= std::chrono::milliseconds(200)) {
      last_ = now;
      std::fprintf(stderr, "\r%3.0f %%", 100.0 * share);
    }
  }
  ~ProgressLine() {
    if (shown_) {
      std::fprintf(stderr, "\r     \r");
    }
  }

 private:
  bool shown_ = isatty(STDERR_FILENO) != 0;
  std::chrono::steady_clock::time_point last_;
};

void PrintSome(const char* title, const std::vector<std::string>& lines) {
  for (std::size_t i = 0; i < std::min(lines.size(), kFindingsShown); ++i) {
    fmt::print("{}: {}\n", title, lines[i]);
  }
  if (lines.size() > kFindingsShown) {
    fmt::print("{}: and {} more\n", title, lines.size() - kFindingsShown);
  }
}

void PrintComparison(const LcmTypes& types, const ResultComparison& comparison) {
  fmt::print("{:<18} {:>8} {:>10} {:>8} {:>6}\n", "channel", "equal", "differing", "missing", "extra");
  for (const auto& [channel, counts] : comparison.channels()) {
    fmt::print("{:<18} {:>8} {:>10} {:>8} {:>6}\n", channel, counts.equal, counts.differing, counts.missing,
               counts.extra);
  }
  if (const auto& first = comparison.first_difference(); first.has_value()) {
    fmt::print("first difference: {} ({})\n", MessageTitle(types, first->channel, first->recorded),
               first->where);
    for (const std::string& line : FieldDifferences(types, first->recorded, first->replayed, kFieldsShown)) {
      fmt::print("  {}\n", line);
    }
  }
}

// Threads change no result, so they are no change of the station.
StationChanges WithThreads(StationChanges changes, int threads) {
  if (threads > 0) {
    changes.values.push_back(fmt::format("reconstruction.threads={}", threads));
    changes.values.push_back(fmt::format("registration.threads={}", threads));
  }
  return changes;
}

// What is wrong with the recording itself.
Status JudgeRecording(const RecordedSession& session, const ReplayOutcome& outcome) {
  if (!outcome.changed_inputs.empty()) {
    return Fail(ErrorCode::kUntrusted, "{} recorded messages are not as they were sent",
                outcome.changed_inputs.size());
  }
  if (!session.findings().empty()) {
    return Fail(ErrorCode::kUntrusted, "the recording is not whole");
  }
  return {};
}

Status Judge(const RecordedSession& session, const ReplayOutcome& outcome) {
  const ChannelComparison total = outcome.comparison.Total();
  const bool as_sent = outcome.changed_inputs.empty(), whole = session.findings().empty();
  if (as_sent && total.equal + total.differing + total.missing == 0) {
    return Fail(ErrorCode::kUntrusted,
                "there is nothing to compare: the recording holds no result of these services");
  }
  if (as_sent && !whole && total.differing + total.missing == 0) {
    return Fail(ErrorCode::kUntrusted,
                "what there is replays equally, but the recording is not whole; {} results are not in it",
                total.extra);
  }
  if (as_sent && !total.Same()) {
    return Fail(ErrorCode::kUntrusted, "the replay's results are not those of the recording{}",
                whole ? "" : ", which is not whole");
  }
  return JudgeRecording(session, outcome);
}

Status WriteWhatIf(const RecordedSession& session, const ReplayArguments& arguments, const WhatIfPage& page,
                   const std::vector<fsmsg::verdict_t>& now) {
  ASSIGN_OR_RETURN(const auto recorded, RecordedVerdicts(session));
  const auto parts = CompareVerdicts(recorded, now);
  fmt::print("{}", WhatIfText(parts));
  return arguments.report.empty() ? Status() : WriteOutputFile(arguments.report, WhatIfHtml(page, parts));
}

bool GivesVerdicts(const std::vector<ReplayableService>& services) {
  return std::any_of(services.begin(), services.end(),
                     [](const auto& service) { return std::string_view(service.name) == "report"; });
}

// Errors: kInvalidArgument (a change or page that these services cannot make).
Status CheckArguments(const ReplayArguments& arguments, const std::vector<ReplayableService>& services) {
  std::vector<std::string> names;
  for (const ReplayableService& service : services) {
    names.emplace_back(service.name);
  }
  if (!arguments.report.empty() && !GivesVerdicts(services)) {
    return Fail(ErrorCode::kInvalidArgument,
                "--report compares verdicts, which the service report gives; computed are {}",
                fmt::join(names, ", "));
  }
  return CheckUsed(arguments.changes, names);
}

// Into the user's folder, beside what is there. Errors: kIo.
Status KeepResults(const fs::path& results, const std::string& folder) {
  std::error_code problem;
  if (folder.empty() || !fs::exists(results, problem)) {
    return {};
  }
  fs::create_directories(folder, problem);
  fs::copy(results, folder, fs::copy_options::recursive | fs::copy_options::overwrite_existing, problem);
  return problem ? Fail(ErrorCode::kIo, "the reports cannot be written to {}: {}", folder, problem.message())
                 : Status();
}

void PrintOutcome(const RecordedSession& session, const ReplayOutcome& outcome, double took_s) {
  PrintSome("changed input", outcome.changed_inputs);
  PrintComparison(session.types(), outcome.comparison);
  const double recorded_s = static_cast<double>(session.duration_us()) * 1e-6;
  fmt::print("{:.1f} s of recording in {:.1f} s, {:.1f} times as fast\n", recorded_s, took_s,
             recorded_s / took_s);
}

// The verdicts of the replay go to `verdicts`.
Result<ReplayOutcome> Compute(const RecordedSession& session, const Station& station, ReplayOptions options,
                              std::vector<fsmsg::verdict_t>& verdicts, const Interrupt& interrupt) {
  options.on_result = [&verdicts](const std::string& channel, ByteView message) {
    if (auto verdict = Decode<fsmsg::verdict_t>(message); channel == kVerdict.name && verdict.ok()) {
      verdicts.push_back(std::move(*verdict));
    }
  };
  ProgressLine progress;
  options.on_progress = [&progress](double share) { progress.Show(share); };
  options.interrupted = [&interrupt] { return interrupt.Requested(); };
  return Replay(session, station, options);
}

Status RunReplay(const ReplayArguments& arguments) {
  spdlog::set_level(spdlog::level::off);  // what the services had to say is in the recording
  ReplayOptions options;
  ASSIGN_OR_RETURN(options.services, SelectServices(arguments.services));
  RETURN_IF_ERROR(CheckArguments(arguments, options.services));
  ASSIGN_OR_RETURN(const auto session, RecordedSession::Open(arguments.logs));
  PrintSome("recording", session.findings());
  const Interrupt interrupt;  // before the folder and the services' threads are made
  ASSIGN_OR_RETURN(const ScratchFolder scratch, ScratchFolder::Make());
  ASSIGN_OR_RETURN(const Station station,
                   UnpackStation(session, WithThreads(arguments.changes, arguments.threads), scratch.path()));
  const bool changed = arguments.changes.Any(), what_if = changed || !arguments.report.empty();
  options.chained = what_if;
  ASSIGN_OR_RETURN(const auto changes, DescribeChanges(session, station));
  PrintSome("changed", changes);
  const bool gives_verdicts = GivesVerdicts(options.services);
  std::vector<fsmsg::verdict_t> verdicts;
  const auto started = std::chrono::steady_clock::now();
  ASSIGN_OR_RETURN(const auto outcome, Compute(session, station, std::move(options), verdicts, interrupt));
  PrintOutcome(session, outcome,
               std::chrono::duration<double>(std::chrono::steady_clock::now() - started).count());
  RETURN_IF_ERROR(KeepResults(station.results, arguments.results));
  if (what_if && gives_verdicts) {
    std::vector<std::string> remarks = session.findings();
    remarks.insert(remarks.end(), outcome.changed_inputs.begin(), outcome.changed_inputs.end());
    RETURN_IF_ERROR(WriteWhatIf(session, arguments,
                                {session.opened().station, arguments.logs, changes, remarks}, verdicts));
  } else if (what_if) {
    fmt::print("no verdicts are computed: that needs the service report\n");
  }
  return changed ? JudgeRecording(session, outcome) : Judge(session, outcome);
}

}  // namespace

void AddReplayCommand(CLI::App& app, Status& outcome) {
  static ReplayArguments arguments;
  CLI::App* command =
      app.add_subcommand("replay", "compute a recorded session again and compare every result byte for byte");
  command->add_option("LOG", arguments.logs, "recordings of parts, in any order")->required();
  command
      ->add_option("--service", arguments.services,
                   "only this one: reconstruction, fusion, registration or report; may be repeated")
      ->allow_extra_args(false);
  command->add_option("--threads", arguments.threads, "for the computation; the results do not depend on it")
      ->check(CLI::Range(1, 64));
  command->add_option("--results", arguments.results, "keep the reports of the replay in this folder");
  command->add_option("--set", arguments.changes.values, "what if: table.key=value of station.toml")
      ->allow_extra_args(false);
  command->add_option("--config", arguments.changes.config, "what if: another station.toml")
      ->check(CLI::ExistingFile);
  for (const char* role : {"calibration", "pattern", "views", "model", "features", "standing"}) {
    command
        ->add_option_function<std::string>(
            std::string("--") + role,
            [role](const std::string& file) { arguments.changes.files[role] = file; },
            std::string("what if: another file for ") + role)
        ->check(CLI::ExistingFile);
  }
  command->add_option("--report", arguments.report, "what if: write the changed sizes and verdicts as HTML");
  command->callback([&outcome] { outcome = RunReplay(arguments); });
}

}  // namespace forgescan
