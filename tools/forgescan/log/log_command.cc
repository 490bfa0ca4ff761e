// forgescan log: what is in a recording, whether it is whole, and what can be made of it.
#include <csignal>
#include <cstdio>
#include <memory>

#include "tools/forgescan/command.h"
#include "tools/forgescan/log/log_check.h"
#include "tools/forgescan/log/log_cut.h"
#include "tools/forgescan/log/log_export.h"
#include "tools/forgescan/log/log_info.h"
#include "tools/forgescan/log/log_repair.h"
#include "tools/forgescan/log/mcap_export.h"
#include "tools/forgescan/log/shown_text.h"

namespace forgescan {
namespace {

using Json = nlohmann::ordered_json;

struct InfoArguments {
  std::vector<std::string> files;
  bool json = false;
};

Result<Json> InfoOfOne(const std::string& file) {
  ASSIGN_OR_RETURN(const Recording recording, OpenRecording(file));
  return LogInfo(recording);
}

// Every log that can be read is shown, whatever the others are.
Status Info(const InfoArguments& arguments) {
  Json all = Json::array();
  std::vector<Error> errors;
  for (const std::string& file : arguments.files) {
    auto info = InfoOfOne(file);
    if (!info.ok()) {
      errors.push_back(info.error());
    } else if (arguments.json) {
      all.push_back(std::move(*info));
    } else {
      std::fputs(LogInfoText(*info).c_str(), stdout);
    }
  }
  if (arguments.json) {
    std::printf("%s\n", all.dump(2, ' ', false, Json::error_handler_t::replace).c_str());
  }
  if (errors.size() <= 1) {
    return errors.empty() ? Status() : Status(errors.front());
  }
  for (const Error& error : errors) {
    fmt::print(stderr, "{}\n", error.message);
  }
  return Fail(errors.front().code, "{} of {} logs cannot be read", errors.size(), arguments.files.size());
}

// The number of findings, each said in a line.
Result<std::size_t> CheckOne(const std::string& file) {
  ASSIGN_OR_RETURN(const Recording recording, OpenRecording(file));
  ASSIGN_OR_RETURN(const std::vector<LogFinding> findings, CheckLog(recording));
  for (const LogFinding& finding : findings) {
    const std::string place = finding.offset ? fmt::format("byte {}: ", *finding.offset) : "";
    const std::string channel = finding.channel.empty() ? "" : finding.channel + ": ";
    fmt::print("{}: {}{}\n", file, place, Shown(channel + finding.what));
  }
  if (findings.empty()) {
    fmt::print("{}: whole and complete, {} events\n", file, recording.log.entries().size());
  }
  return findings.size();
}

Status Check(const std::vector<std::string>& files) {
  std::size_t findings = 0, bad_files = 0;
  for (const std::string& file : files) {
    const auto found = CheckOne(file);
    if (!found.ok()) {
      fmt::print("{}\n", found.error().message);
    }
    const std::size_t count = found.ok() ? *found : 1;
    findings += count;
    bad_files += count > 0 ? 1 : 0;
  }
  return bad_files == 0
             ? Status()
             : Fail(ErrorCode::kUntrusted, "{} findings in {} of {} logs", findings, bad_files, files.size());
}

void AddInfo(CLI::App& log, Status& outcome) {
  auto arguments = std::make_shared<InfoArguments>();
  CLI::App* command = log.add_subcommand("info", "Events, channels, types and damage of logs");
  command->add_option("file", arguments->files, "LCM logs")->required();
  command->add_flag("--json", arguments->json, "an array with one object a log, for programs");
  command->callback([arguments, &outcome] { outcome = Info(*arguments); });
}

void AddCheck(CLI::App& log, Status& outcome) {
  auto files = std::make_shared<std::vector<std::string>>();
  CLI::App* command =
      log.add_subcommand("check", "Every message of a log; exit code 0 only if it is whole and complete");
  command->add_option("file", *files, "LCM logs")->required();
  command->callback([files, &outcome] { outcome = Check(*files); });
}

// For commands that make files: a reader of their words that goes away (| head) is an error like any other,
// after which nothing half is left behind.
void FailWithoutReader(CLI::App& command) {
  command.preparse_callback([](std::size_t) { std::signal(SIGPIPE, SIG_IGN); });
}

void AddRepair(CLI::App& log, Status& outcome) {
  auto arguments = std::make_shared<std::pair<std::string, std::string>>();
  CLI::App* command = log.add_subcommand("repair", "Write the undamaged events of a log to a new one");
  command->add_option("file", arguments->first, "LCM log")->required();
  command->add_option("--out", arguments->second, "the new log; must not exist")->required();
  FailWithoutReader(*command);
  command->callback([arguments, &outcome] { outcome = RepairLog(arguments->first, arguments->second); });
}

void AddCut(CLI::App& log, Status& outcome) {
  auto cut = std::make_shared<LogCut>();
  CLI::App* command = log.add_subcommand("cut", "Write some of a log's events to a new one");
  command->add_option("file", cut->file, "LCM log")->required();
  command->add_option("--out", cut->out, "the new log; must not exist")->required();
  command->add_option("--from", cut->from,
                      "first time: us since 1970, or +SECONDS after the log's first event");
  command->add_option("--to", cut->to, "last time, in the same way");
  command->add_option("--channel", cut->channels,
                      "regular expressions; a channel matches one of them as a whole");
  command->add_option("--part", cut->part, "only messages that name this part");
  command->add_option("--view", cut->view, "only messages that name this view");
  FailWithoutReader(*command);
  command->callback([cut, &outcome] { outcome = CutLog(*cut); });
}

// What is wrong with either; the same sentence once.
Status Both(const Status& one, const Status& other) {
  if (one.ok() || other.ok() || one.error().message == other.error().message) {
    return one.ok() ? other : one;
  }
  return Fail(one.error().code, "{}; {}", one.error().message, other.error().message);
}

void AddExport(CLI::App& log, Status& outcome) {
  struct Arguments {
    std::string file, mcap;
    LogExport what;
  };
  auto arguments = std::make_shared<Arguments>();
  CLI::App* command =
      log.add_subcommand("export", "Images as PNG, clouds as PLY, messages as JSON lines; or MCAP");
  command->add_option("file", arguments->file, "LCM log")->required();
  auto* out = command->add_option("--out", arguments->what.folder, "a folder to make; must not exist");
  for (auto [name, flag] : {std::pair{"--images", &arguments->what.images},
                            {"--clouds", &arguments->what.clouds},
                            {"--messages", &arguments->what.messages}}) {
    command->add_flag(name, *flag, "only these (several may be given)")->needs(out);
  }
  command->add_option("--mcap", arguments->mcap, "everything as one MCAP file, for Foxglove; must not exist");
  FailWithoutReader(*command);
  command->callback([arguments, &outcome] {
    if (arguments->what.folder.empty() && arguments->mcap.empty()) {
      outcome = Fail(ErrorCode::kInvalidArgument, "log export needs --out FOLDER, --mcap FILE or both");
      return;
    }
    if (!arguments->what.folder.empty()) {
      outcome = ExportLog(arguments->file, arguments->what);
    }
    if (!arguments->mcap.empty()) {
      outcome = Both(outcome, ExportMcap(arguments->file, arguments->mcap));
    }
  });
}

}  // namespace

void AddLogCommand(CLI::App& app, Status& outcome) {
  CLI::App* log = app.add_subcommand("log", "Look into recordings, check, repair, cut and export them");
  log->require_subcommand(1);
  AddInfo(*log, outcome);
  AddCheck(*log, outcome);
  AddRepair(*log, outcome);
  AddCut(*log, outcome);
  AddExport(*log, outcome);
}

}  // namespace forgescan
