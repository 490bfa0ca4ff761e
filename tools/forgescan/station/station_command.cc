// forgescan station up|down|status|units FOLDER
#include <sys/ioctl.h>
#include <unistd.h>

#include <csignal>
#include <cstdio>

#include "services/common/bus/stream_hub.h"
#include "tools/forgescan/command.h"
#include "tools/forgescan/station/interrupt.h"
#include "tools/forgescan/station/network.h"
#include "tools/forgescan/station/station_runner.h"
#include "tools/forgescan/station/station_units.h"

namespace forgescan {
namespace {

constexpr std::int64_t kReadyPatienceUs = 60'000'000;
constexpr std::int64_t kStatusListenUs = 2'500'000;  // every service speaks once a second
constexpr std::int64_t kRedrawUs = 1'000'000;

struct StationOptions {
  std::string folder;
  bool json = false;
  UnitOptions units;
};

int TerminalWidth() {
  winsize size{};
  return ioctl(STDOUT_FILENO, TIOCGWINSZ, &size) == 0 && size.ws_col > 0 ? size.ws_col : 140;
}

// Redraws the table, or waits for the station to be ready and says so once.
class Watch {
 public:
  explicit Watch(StationRunner& runner)
      : runner_(runner), terminal_(isatty(STDOUT_FILENO) != 0), since_us_(runner.bus().NowUs()) {}

  void Look() {
    if (terminal_) {
      std::printf("\x1b[H\x1b[2Jstation %s (Ctrl-C stops it)\n%s", runner_.station().name.c_str(),
                  runner_.Table(TerminalWidth(), true).c_str());
      std::fflush(stdout);
    }
    const bool late = runner_.bus().NowUs() - since_us_ > kReadyPatienceUs;
    if (!told_ && runner_.AllReady()) {
      runner_.log().Write("station", "is up");
      told_ = true;
    } else if (!told_ && late) {  // devices may be switched on later
      runner_.log().Write("station", "is not ready yet:\n" + runner_.Table(100, false), true);
      told_ = true;
    }
  }

 private:
  StationRunner& runner_;
  bool terminal_;
  std::int64_t since_us_;
  bool told_ = false;
};

Status Up(const StationOptions& options) {
  const Interrupt interrupt;
  RETURN_IF_ERROR(EnsureNetwork(options.folder));
  const Echo echo = isatty(STDOUT_FILENO) != 0 ? Echo::kNothing : Echo::kAll;
  ASSIGN_OR_RETURN(const auto runner, StationRunner::Create(options.folder, echo));
  Watch watch(*runner);
  Status status;
  while (status.ok() && !interrupt.Requested()) {
    status = runner->RunFor(kRedrawUs);
    watch.Look();
  }
  const Status stopped = runner->Stop();
  return status.ok() ? stopped : status;
}

Status Down(const StationOptions& options) {
  ASSIGN_OR_RETURN(const RunningStation station, RunningStation::Find(options.folder));
  kill(station.pid(), SIGTERM);
  constexpr int kStepsPerS = 10;
  for (int step = 0; step < station.stop_patience_s() * kStepsPerS; ++step) {
    if (!station.IsUp()) {
      std::printf("station %s is down\n", options.folder.c_str());
      return station.Outcome();
    }
    usleep(1'000'000 / kStepsPerS);
  }
  return Fail(ErrorCode::kTimeout, "station {} (process {}) has not stopped within {} s", options.folder,
              station.pid(), station.stop_patience_s());
}

Status ShowStatus(const StationOptions& options) {
  ASSIGN_OR_RETURN(const RunningStation running, RunningStation::Find(options.folder));
  ASSIGN_OR_RETURN(const Station station, Station::Load(options.folder));
  RETURN_IF_ERROR(JoinNetworkOf(running.pid()));
  ASSIGN_OR_RETURN(const auto bus, LcmBus::Open(station.bus_url));
  const StateTable table(*bus);
  ProcessUsage usage;
  std::vector<std::string> names;
  std::vector<TableRow> rows;
  for (const StationService& service : StationServices(station)) {
    const auto found = running.services().find(service.name);
    const ServiceProcess known = found == running.services().end() ? ServiceProcess{} : found->second;
    static_cast<void>(
        usage.Of(known.process.pid, bus->NowUs()));  // the processor's share is of the time from here
    names.push_back(service.name);
    rows.push_back(
        {.service = service.name, .usage = {}, .restarts = known.restarts, .given_up = known.given_up});
  }
  const std::int64_t until_us = bus->NowUs() + kStatusListenUs;
  while (bus->NowUs() < until_us) {
    RETURN_IF_ERROR(bus->RunOnce(until_us - bus->NowUs()));
  }
  for (TableRow& row : rows) {
    const auto found = running.services().find(row.service);
    row.usage =
        found == running.services().end() ? std::nullopt : usage.Of(found->second.process.pid, bus->NowUs());
  }
  if (options.json) {
    std::printf("%s\n", table.Json(rows).c_str());
  } else {
    std::printf("station %s\n%s", station.name.c_str(),
                table.Render(rows, TerminalWidth(), isatty(STDOUT_FILENO) != 0).c_str());
  }
  return table.AllReady(names) ? Status() : Fail(ErrorCode::kUnavailable, "not every service is ready");
}

Status WriteUnits(const StationOptions& options) {
  UnitOptions units = options.units;
  units.folder = options.folder;
  units.programs = ProgramFolder();
  return WriteStationUnits(units);
}

}  // namespace

void AddStationCommand(CLI::App& app, Status& outcome) {
  CLI::App* station = app.add_subcommand("station", "start, stop and look at the services of a station");
  station->require_subcommand(1);
  static StationOptions options;
  const auto add = [&](const char* name, const char* what, Status (*run)(const StationOptions&)) {
    CLI::App* command = station->add_subcommand(name, what);
    command->add_option("FOLDER", options.folder, "the station's folder, with station.toml")
        ->required()
        ->check(CLI::ExistingDirectory);
    command->callback([&outcome, run] { outcome = run(options); });
    return command;
  };
  add("up", "start the services, keep them running and show them until Ctrl-C or `station down`", Up);
  add("down", "stop the services in order, once the parts in work are judged", Down);
  add("status", "show what every service says of itself", ShowStatus)
      ->add_flag("--json", options.json, "for other programs");
  CLI::App* units = add("units", "write systemd units that run the station in production", WriteUnits);
  units->add_option("--out", options.units.out, "folder for the unit files")->required();
  units->add_option("--user", options.units.user, "account the services run under")->capture_default_str();
}

}  // namespace forgescan
