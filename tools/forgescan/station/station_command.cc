// forgescan station up|down|status FOLDER
#include <fcntl.h>
#include <sys/file.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include <csignal>
#include <cstdio>
#include <filesystem>
#include <fstream>

#include "tools/forgescan/command.h"
#include "tools/forgescan/station/interrupt.h"
#include "tools/forgescan/station/network.h"
#include "tools/forgescan/station/station_runner.h"
#include "tools/forgescan/station/station_services.h"

namespace forgescan {
namespace {

constexpr std::int64_t kReadyPatienceUs = 30'000'000;
constexpr std::int64_t kStatusListenUs = 2'500'000;  // every service speaks once a second
constexpr std::int64_t kRedrawUs = 1'000'000;

std::string PidFile(const std::string& folder) {
  return (std::filesystem::path(folder) / "station.pid").string();
}

// The process that runs the station: it holds a lock on its file, so a file left behind by a crash names
// nobody. Errors: kNotFound (none does).
Result<int> RunningPid(const std::string& folder) {
  int pid = 0;
  std::ifstream(PidFile(folder)) >> pid;
  const int fd = open(PidFile(folder).c_str(), O_RDONLY | O_CLOEXEC);
  const bool locked = fd >= 0 && flock(fd, LOCK_EX | LOCK_NB) != 0;
  close(fd);
  if (!locked || pid <= 0) {
    return Fail(ErrorCode::kNotFound, "station {} is not up", folder);
  }
  return pid;
}

// Held by `station up` while it runs.
class PidLock {
 public:
  explicit PidLock(const std::string& folder)
      : path_(PidFile(folder)), fd_(open(path_.c_str(), O_RDWR | O_CREAT | O_TRUNC | O_CLOEXEC, 0644)) {
    const std::string pid = std::to_string(getpid()) + "\n";
    held_ = fd_ >= 0 && flock(fd_, LOCK_EX | LOCK_NB) == 0 &&
            write(fd_, pid.data(), pid.size()) == static_cast<ssize_t>(pid.size());
  }
  ~PidLock() {
    if (held_) {
      std::filesystem::remove(path_);
    }
    close(fd_);
  }
  PidLock(const PidLock&) = delete;
  PidLock& operator=(const PidLock&) = delete;
  bool held() const { return held_; }

 private:
  std::string path_;
  int fd_;
  bool held_ = false;
};

int TerminalWidth() {
  winsize size{};
  return ioctl(STDOUT_FILENO, TIOCGWINSZ, &size) == 0 && size.ws_col > 0 ? size.ws_col : 140;
}

Status Watch(StationRunner& runner, const Interrupt& interrupt) {
  const bool terminal = isatty(STDOUT_FILENO) != 0;
  while (!interrupt.Requested()) {
    RETURN_IF_ERROR(runner.RunFor(kRedrawUs));
    if (terminal) {
      std::printf("\x1b[H\x1b[2Jstation %s (Ctrl-C stops it)\n%s", runner.station().name.c_str(),
                  runner.Table(TerminalWidth(), true).c_str());
      std::fflush(stdout);
    }
  }
  return {};
}

Status Up(const std::string& folder) {
  if (RunningPid(folder).ok()) {
    return Fail(ErrorCode::kInvalidArgument, "station {} is up already; forgescan station down {} stops it",
                folder, folder);
  }
  const Interrupt interrupt;
  if (!HasMulticastRoute()) {
    RETURN_IF_ERROR(EnterPrivateNetwork());
  }
  const PidLock lock(folder);
  if (!lock.held()) {
    return Fail(ErrorCode::kIo, "{} cannot be written", PidFile(folder));
  }
  ASSIGN_OR_RETURN(const auto runner, StationRunner::Start(folder));
  Status status = runner->WaitUntilReady(kReadyPatienceUs);
  if (status.ok()) {
    std::printf("station %s is up\n", runner->station().name.c_str());
    std::fflush(stdout);
    status = Watch(*runner, interrupt);
  }
  runner->Stop();
  return status;
}

Status Down(const std::string& folder) {
  ASSIGN_OR_RETURN(const int pid, RunningPid(folder));
  kill(pid, SIGTERM);
  constexpr int kPatienceSteps = 600;
  for (int step = 0; step < kPatienceSteps; ++step) {
    if (!RunningPid(folder).ok()) {
      std::printf("station %s is down\n", folder.c_str());
      return {};
    }
    usleep(100'000);
  }
  return Fail(ErrorCode::kTimeout, "station {} (process {}) has not stopped within 60 s", folder, pid);
}

Status ShowStatus(const std::string& folder) {
  ASSIGN_OR_RETURN(const int pid, RunningPid(folder));
  if (!HasMulticastRoute()) {
    RETURN_IF_ERROR(JoinNetworkOf(pid));
  }
  ASSIGN_OR_RETURN(const Station station, Station::Load(folder));
  ASSIGN_OR_RETURN(const auto bus, LcmBus::Open(station.bus_url));
  const StateTable table(*bus);
  const std::int64_t until_us = bus->NowUs() + kStatusListenUs;
  while (bus->NowUs() < until_us) {
    RETURN_IF_ERROR(bus->RunOnce(until_us - bus->NowUs()));
  }
  std::vector<std::string> names;
  for (const StationService& service : StationServices()) {
    names.push_back(service.name);
  }
  std::printf("station %s\n%s", station.name.c_str(),
              table.Render(names, TerminalWidth(), isatty(STDOUT_FILENO) != 0).c_str());
  return table.AllReady(names) ? Status() : Fail(ErrorCode::kUnavailable, "not every service is ready");
}

}  // namespace

void AddStationCommand(CLI::App& app, Status& outcome) {
  CLI::App* station = app.add_subcommand("station", "start, stop and look at the services of a station");
  station->require_subcommand(1);
  static std::string folder;
  const auto add = [&](const char* name, const char* what, Status (*run)(const std::string&)) {
    CLI::App* command = station->add_subcommand(name, what);
    command->add_option("FOLDER", folder, "the station's folder, with station.toml")
        ->required()
        ->check(CLI::ExistingDirectory);
    command->callback([&outcome, run] { outcome = run(folder); });
  };
  add("up", "start the services and show them until Ctrl-C or `station down`", Up);
  add("down", "stop the services in order", Down);
  add("status", "show what every service says of itself", ShowStatus);
}

}  // namespace forgescan
