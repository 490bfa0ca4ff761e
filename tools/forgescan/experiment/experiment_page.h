// The page that the experiments write: one marked section each, and a picture beside the page.
#pragma once

#include <filesystem>
#include <string>

#include "tools/forgescan/experiment/experiment.h"

namespace forgescan {

// The section as Markdown, without its marks: question, tables, goals, picture, remarks, and the command that
// makes it again. No time of day: equal options give equal bytes.
std::string SectionText(const Experiment& experiment, const ExperimentOptions& options,
                        const ExperimentReport& report);

// For a terminal: tables and goals with aligned columns.
std::string TerminalText(const Experiment& experiment, const ExperimentReport& report);

// Puts the section into a page, in the order of Experiments(), in place of an earlier one of the same name.
// An empty page gets its head first. Errors: kInvalidArgument for a page that is not of this command, or
// whose marks do not pair.
Result<std::string> WithSection(const std::string& page, const std::string& name, const std::string& section);

// Writes FOLDER/experiments.md and FOLDER/experiments/NAME.svg, each whole or not at all. Errors:
// kInvalidArgument when a file of that name is not one of this command's; kIo, kNotFound.
Status WriteExperiment(const std::filesystem::path& folder, const std::string& name,
                       const std::string& section, const std::string& svg);

// The same checks before an experiment is run, so that an hour's work is not refused at its end.
Status CheckPlace(const std::filesystem::path& folder, const std::string& name);

}  // namespace forgescan
