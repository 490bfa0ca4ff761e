// forgescan experiment NAME: runs one experiment, prints its tables and writes its section of the page.
#include <cstdio>
#include <memory>

#include "tools/finite_range.h"
#include "tools/forgescan/command.h"
#include "tools/forgescan/experiment/experiment_page.h"

namespace forgescan {
namespace {

struct Arguments {
  std::string name;
  std::string out = "docs";
  ExperimentOptions options;
};

const Experiment* Find(const std::string& name) {
  for (const Experiment& experiment : Experiments()) {
    if (experiment.name == name) return &experiment;
  }
  return nullptr;
}

std::vector<std::string> Names() {
  std::vector<std::string> names;
  for (const Experiment& experiment : Experiments()) names.emplace_back(experiment.name);
  return names;
}

std::string Footer() {
  std::string text = "Experiments, and what --runs counts:\n";
  for (const Experiment& e : Experiments()) {
    text += fmt::format("  {:14} {} ({}: {})\n", e.name, e.title, e.runs, e.default_runs);
  }
  return text;
}

Status Run(const Arguments& arguments) {
  const Experiment* experiment = Find(arguments.name);
  if (experiment == nullptr) {
    return Fail(ErrorCode::kNotFound, "{} is no experiment", arguments.name);
  }
  RETURN_IF_ERROR(CheckPlace(arguments.out, arguments.name));
  ExperimentOptions options = arguments.options;
  if (options.runs == 0) options.runs = experiment->default_runs;
  ASSIGN_OR_RETURN(const ExperimentReport report, experiment->run(options));
  std::fputs(TerminalText(*experiment, report).c_str(), stdout);
  return WriteExperiment(arguments.out, arguments.name, SectionText(*experiment, arguments.options, report),
                         report.svg);
}

}  // namespace

void AddExperimentCommand(CLI::App& app, Status& outcome) {
  auto arguments = std::make_shared<Arguments>();
  ExperimentOptions& options = arguments->options;
  CLI::App* command = app.add_subcommand("experiment", "Repeat an experiment of the paper with known truth");
  command->footer(Footer());
  command->add_option("name", arguments->name, "which")->required()->check(CLI::IsMember(Names()));
  command->add_option("--out", arguments->out, "folder of experiments.md and experiments/NAME.svg")
      ->capture_default_str();
  command->add_option("--seed", options.seed, "of everything that is drawn")->capture_default_str();
  command->add_option("--runs", options.runs, "how often; 0: as the record")
      ->check(FiniteRange(0, 1e6))
      ->capture_default_str();
  command->add_option("--scale-divisor", options.scale_divisor, "of the virtual cameras' images: 1, 2, 4, 8")
      ->check(CLI::IsMember({1, 2, 4, 8}))
      ->capture_default_str();
  command->add_option("--threads", options.threads)->check(FiniteRange(1, 64))->capture_default_str();
  command->add_option("--cell", options.cell, "configuration of the virtual cell")->capture_default_str();
  command->add_option("--station", options.station, "folder whose station.toml has the settings")
      ->capture_default_str();
  command->callback([arguments, &outcome] { outcome = Run(*arguments); });
}

}  // namespace forgescan
