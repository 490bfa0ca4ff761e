#include <cstdio>
#include <exception>

#include "tools/forgescan/command.h"

namespace {

int Run(int argc, char** argv) {
  CLI::App app{"forgescan: in-line 3D inspection of hot forgings"};
  app.require_subcommand(1);
  forgescan::Status outcome;
  try {
    forgescan::AddReconstructCommand(app, outcome);
    forgescan::AddRegisterCommand(app, outcome);
    forgescan::AddFitCommand(app, outcome);
    forgescan::AddCalibrationCommand(app, outcome);
    forgescan::AddModelCommand(app, outcome);
    forgescan::AddStationCommand(app, outcome);
    forgescan::AddInspectCommand(app, outcome);
    forgescan::AddReplayCommand(app, outcome);
    forgescan::AddPlayCommand(app, outcome);
    forgescan::AddLogCommand(app, outcome);
    forgescan::AddStandingCommand(app, outcome);
    forgescan::AddExperimentCommand(app, outcome);
    const auto is_named = [argv](const CLI::App* command) { return command->check_name(argv[1]); };
    if (argc > 1 && argv[1][0] != '-' && app.get_subcommands(is_named).empty()) {
      std::fprintf(stderr, "forgescan: %s is no command, --help lists them\n", argv[1]);
      return 1;
    }
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "forgescan: %s\n", error.what());
    return 1;
  }
  if (!outcome.ok()) {
    std::fflush(stdout);  // what there is comes before what is wrong with it; main() looks whether it came out
    std::fprintf(stderr, "forgescan: %s\n", outcome.error().message.c_str());
    return 1;
  }
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  const int code = Run(argc, argv);
  if (code == 0 && (std::fflush(stdout) != 0 || std::ferror(stdout) != 0)) {  // a result nobody has
    std::fprintf(stderr, "forgescan: standard output cannot be written\n");
    return 1;
  }
  return code;
}
