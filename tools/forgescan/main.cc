#include <cstdio>
#include <exception>

#include "tools/forgescan/command.h"

int main(int argc, char** argv) {
  CLI::App app{"forgescan: in-line 3D inspection of hot forgings"};
  app.require_subcommand(1);
  forgescan::Status outcome;
  try {
    forgescan::AddReconstructCommand(app, outcome);
    forgescan::AddRegisterCommand(app, outcome);
    forgescan::AddFitCommand(app, outcome);
    forgescan::AddModelCommand(app, outcome);
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "forgescan: %s\n", error.what());
    return 1;
  }
  if (!outcome.ok()) {
    std::fprintf(stderr, "forgescan: %s\n", outcome.error().message.c_str());
    return 1;
  }
  return 0;
}
