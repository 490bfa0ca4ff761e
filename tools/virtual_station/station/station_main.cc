// forgescan-virtual-station prepare|run: a forging cell that consists of two GigE Vision cameras and a CAN
// bus.
#include <sys/signalfd.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <csignal>
#include <cstdio>
#include <filesystem>
#include <regex>

#include "services/common/config/config.h"
#include "services/common/input_file.h"
#include "tools/finite_range.h"
#include "tools/virtual_station/commissioning.h"
#include "tools/virtual_station/station/live_cell.h"
#include "tools/virtual_station/station_writer.h"
#include "tools/virtual_station/whole_file.h"

namespace {

using namespace forgescan;
namespace fs = std::filesystem;

struct Arguments {
  std::string station = "stations/virtual";  // prepare: folder with station.toml
  std::string cell = "cell.toml";            // prepare: in that folder
  std::string run;                           // folder of this run
  int scale_divisor = 0;                     // 0: as the cell file says
  int parts = 1;
  double takt_s = 45.0;
  bool start = false;
};

// Copies the station and the cell into the run's folder and commissions the station: calibration, views,
// model, and what station.toml says of cameras and steel.
Status Prepare(const Arguments& arguments) {
  const fs::path run(arguments.run), station(arguments.station);
  std::error_code problem;
  fs::create_directories(run / "station", problem);
  fs::create_directories(run / "truth", problem);
  ASSIGN_OR_RETURN(const std::string station_text, ReadInputFile(station / "station.toml"));
  ASSIGN_OR_RETURN(std::string cell_text, ReadInputFile(station / arguments.cell));
  if (arguments.scale_divisor != 0) {
    cell_text = std::regex_replace(cell_text, std::regex("scale_divisor = \\d+"),
                                   fmt::format("scale_divisor = {}", arguments.scale_divisor));
  }
  RETURN_IF_ERROR(WriteWholeFile((run / "cell.toml").string(), cell_text));
  ASSIGN_OR_RETURN(const CellConfig config, LoadCellConfig((run / "cell.toml").string()));
  RETURN_IF_ERROR(CheckImageSize(config, station_text));
  ASSIGN_OR_RETURN(const std::string commissioned, CommissionedStation(config, station_text));
  RETURN_IF_ERROR(WriteWholeFile((run / "station/station.toml").string(), commissioned));
  return WriteStation(config, ProjectedSet::kReduced, (run / "station").string());
}

Result<LiveCellOptions> Wires(const Arguments& arguments) {
  ASSIGN_OR_RETURN(const ConfigFile file, ConfigFile::Load(arguments.run + "/station/station.toml"));
  ConfigTable root = file.Root();
  ConfigTable camera = root.Table("camera");
  LiveCellOptions options;
  root.Table("station").Required("can", options.can_url);
  camera.Table("left").Required("address", options.camera_address[0]);
  camera.Table("right").Required("address", options.camera_address[1]);
  options.truth_folder = arguments.run + "/truth";
  options.parts = arguments.parts;
  options.takt_s = arguments.takt_s;
  if (options.can_url.empty() || options.camera_address[0].empty() || options.camera_address[1].empty()) {
    return Fail(ErrorCode::kNotFound,
                "{}: station.can, camera.left.address and camera.right.address are required", file.path());
  }
  return options;
}

// SIGINT and SIGTERM end the cell, SIGUSR1 starts the line.
Status Run(const Arguments& arguments) {
  sigset_t signals;
  sigemptyset(&signals);
  for (const int signal : {SIGINT, SIGTERM, SIGUSR1}) {
    sigaddset(&signals, signal);
  }
  sigprocmask(SIG_BLOCK, &signals, nullptr);  // before any thread is started
  const int fd = signalfd(-1, &signals, SFD_NONBLOCK | SFD_CLOEXEC);
  ASSIGN_OR_RETURN(const LiveCellOptions options, Wires(arguments));
  ASSIGN_OR_RETURN(CellConfig config, LoadCellConfig(arguments.run + "/cell.toml"));
  ASSIGN_OR_RETURN(const auto cell, LiveCell::Create(std::move(config), options));
  if (arguments.start) {
    cell->StartLine();
  }
  std::printf("the cell is powered up\n");
  std::fflush(stdout);
  while (true) {
    RETURN_IF_ERROR(cell->Step());
    signalfd_siginfo received{};
    if (read(fd, &received, sizeof received) != sizeof received) {
      continue;
    }
    if (received.ssi_signo != SIGUSR1) {
      close(fd);
      return {};
    }
    std::printf("the line starts\n");
    std::fflush(stdout);
    cell->StartLine();
  }
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app{"A virtual forging cell: two GigE Vision cameras and a CAN bus"};
  app.require_subcommand(1);
  Arguments arguments;
  Status outcome;
  CLI::App* prepare = app.add_subcommand("prepare", "commission the station of a run");
  prepare->add_option("--station", arguments.station, "folder with station.toml")->capture_default_str();
  prepare->add_option("--cell", arguments.cell, "the cell's imperfections, a file of that folder")
      ->capture_default_str();
  prepare->add_option("--scale-divisor", arguments.scale_divisor, "1, 2, 4 or 8: smaller images")
      ->check(CLI::IsMember({1, 2, 4, 8}));
  prepare->add_option("--run", arguments.run, "folder of the run")->required();
  CLI::App* run = app.add_subcommand("run", "be the cell until SIGTERM; SIGUSR1 starts the line");
  run->add_option("--run", arguments.run, "folder of the run")->required();
  run->add_option("--parts", arguments.parts, "parts on the line, 0 = for ever")
      ->check(CLI::NonNegativeNumber);
  run->add_option("--takt-s", arguments.takt_s, "from part to part")->check(FiniteRange(10, 3600));
  run->add_flag("--start", arguments.start, "start the line at once");
  prepare->callback([&] { outcome = Prepare(arguments); });
  run->callback([&] { outcome = Run(arguments); });
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error);
  } catch (const std::exception& error) {
    outcome = Fail(ErrorCode::kIo, "{}", error.what());
  }
  if (!outcome.ok()) {
    std::fprintf(stderr, "forgescan-virtual-station: %s\n", outcome.error().message.c_str());
    return 1;
  }
  return 0;
}
