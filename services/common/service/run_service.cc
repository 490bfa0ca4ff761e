#include "services/common/service/run_service.h"

#include <spdlog/sinks/stdout_color_sinks.h>
#include <spdlog/spdlog.h>
#include <sys/signalfd.h>
#include <unistd.h>

#include <csignal>
#include <cstdio>
#include <cstdlib>

#include "services/common/service/service_manager.h"

namespace forgescan {
namespace {

// SIGINT and SIGTERM as a file descriptor of the loop: they end it between two handlers, never inside one.
int OpenSignals() {
  sigset_t signals;
  sigemptyset(&signals);
  sigaddset(&signals, SIGINT);
  sigaddset(&signals, SIGTERM);
  sigprocmask(SIG_BLOCK, &signals, nullptr);
  return signalfd(-1, &signals, SFD_CLOEXEC | SFD_NONBLOCK);
}

// A second signal while the service ends its work is another call, not an endless one.
void TakeSignal(int signals) {
  signalfd_siginfo taken{};
  [[maybe_unused]] const ssize_t bytes = read(signals, &taken, sizeof taken);
}

void WarnOfSmallBuffer(const BusHealth& health) {
  if (health.receive_buffer_bytes < kWantedReceiveBufferBytes) {
    spdlog::warn(
        "the bus socket's receive buffer is {} bytes, {} are wanted: frames will often be lost and sent "
        "again; "
        "sysctl net.core.rmem_max={} allows it",
        health.receive_buffer_bytes, kWantedReceiveBufferBytes, kWantedReceiveBufferBytes / 2);
  }
}

// A word that is lost is said again within a second; one lost for good lets the watchdog act.
void Tell(const ServiceManager& manager, const std::string& what) {
  if (const Status told = manager.Notify(what); !told.ok()) {
    spdlog::warn("{}", told.error().message);
  }
}

Status Run(const std::string& name, const std::string& folder, const std::string& notify_socket,
           const ServiceFactory& factory) {
  const int signals = OpenSignals();  // before any library starts a thread
  ASSIGN_OR_RETURN(const Station station, Station::Load(folder));
  ASSIGN_OR_RETURN(const auto bus, LcmBus::Open(station.bus_url));
  WarnOfSmallBuffer(bus->Health());
  ASSIGN_OR_RETURN(const ServiceManager manager, ServiceManager::Connect(notify_socket));
  StreamHub hub(*bus, name);
  ServiceMonitor monitor(hub, name, station.file.hash());
  std::function<void()> stop = [&bus] { bus->Stop(); };
  bus->Watch(signals, [&stop, signals] {
    TakeSignal(signals);
    stop();
  });
  ASSIGN_OR_RETURN(const std::shared_ptr<void> service, factory({{station, hub, monitor}, *bus, stop}));
  spdlog::info("running on station {}", station.name);
  Tell(manager, "READY=1");
  // With every word on the bus, and so from the working loop: a hung service misses its watchdog.
  monitor.OnPublish(
      [&manager](const std::string& text) { Tell(manager, "WATCHDOG=1\n" + StatusLine(text)); });
  const Status status = bus->Run();
  Tell(manager, "STOPPING=1");
  monitor.SetState(ServiceState::kStopping, "stopping");
  close(signals);
  return status;
}

}  // namespace

int RunService(const std::string& name, int argc, char** argv, const ServiceFactory& factory) {
  if (argc != 3 || std::string(argv[1]) != "--station") {
    std::fprintf(stderr, "usage: forgescan-%s --station FOLDER\n", name.c_str());
    return 2;
  }
  spdlog::set_default_logger(spdlog::stderr_color_mt(name));
  spdlog::set_pattern("%Y-%m-%d %H:%M:%S.%e %n %l: %v");
  const char* notify_socket = std::getenv("NOTIFY_SOCKET");  // set by systemd, for units of Type=notify
  const Status status = Run(name, argv[2], notify_socket == nullptr ? "" : notify_socket, factory);
  if (!status.ok()) {
    spdlog::error("{}", status.error().message);
    return 1;
  }
  spdlog::info("stopped");
  return 0;
}

}  // namespace forgescan
