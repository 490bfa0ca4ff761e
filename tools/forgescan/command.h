// The subcommands of the forgescan tool. Each Add...Command adds itself to the program; when the user calls
// it, its outcome is stored, and main() turns it into the exit code: 0 only for a trustworthy result.
#pragma once

#include <CLI/CLI.hpp>

#include "services/common/result.h"

namespace forgescan {

void AddReconstructCommand(CLI::App& app, Status& outcome);
void AddRegisterCommand(CLI::App& app, Status& outcome);
void AddFitCommand(CLI::App& app, Status& outcome);
void AddCalibrationCommand(CLI::App& app, Status& outcome);
void AddModelCommand(CLI::App& app, Status& outcome);
void AddStationCommand(CLI::App& app, Status& outcome);
void AddInspectCommand(CLI::App& app, Status& outcome);
void AddReplayCommand(CLI::App& app, Status& outcome);
void AddPlayCommand(CLI::App& app, Status& outcome);
void AddLogCommand(CLI::App& app, Status& outcome);
void AddStandingCommand(CLI::App& app, Status& outcome);
void AddExperimentCommand(CLI::App& app, Status& outcome);

}  // namespace forgescan
