#include "tools/forgescan/station/station_runner.h"

#include <filesystem>

#include "tools/forgescan/station/station_services.h"

namespace forgescan {

std::string ProgramFolder() { return std::filesystem::read_symlink("/proc/self/exe").parent_path().string(); }

StationRunner::StationRunner(Station station, std::unique_ptr<LcmBus> bus)
    : station_(std::move(station)),
      bus_(std::move(bus)),
      table_(*bus_),
      processes_((std::filesystem::path(station_.folder) / "log").string()) {}

Result<std::unique_ptr<StationRunner>> StationRunner::Start(const std::string& folder) {
  ASSIGN_OR_RETURN(Station station, Station::Load(folder));
  ASSIGN_OR_RETURN(auto bus, LcmBus::Open(station.bus_url));
  std::unique_ptr<StationRunner> runner(new StationRunner(std::move(station), std::move(bus)));
  for (const StationService& service : StationServices()) {
    std::vector<std::string> command{ProgramFolder() + "/" + service.program};
    command.insert(command.end(), service.arguments.begin(), service.arguments.end());
    command.insert(command.end(), {"--station", folder});
    RETURN_IF_ERROR(runner->processes_.Start(service.name, command));
    runner->names_.push_back(service.name);
  }
  return runner;
}

Status StationRunner::WaitUntilReady(std::int64_t patience_us) {
  const std::int64_t until_us = bus_->NowUs() + patience_us;
  while (!table_.AllReady(names_)) {
    if (bus_->NowUs() > until_us) {
      return Fail(ErrorCode::kUnavailable, "station {} is not ready after {} s:\n{}", station_.name,
                  patience_us / 1'000'000, table_.Render(names_, 160, false));
    }
    RETURN_IF_ERROR(RunFor(100'000));
  }
  return {};
}

Status StationRunner::RunFor(std::int64_t duration_us) {
  const std::int64_t until_us = bus_->NowUs() + duration_us;
  do {
    RETURN_IF_ERROR(bus_->RunOnce(std::max<std::int64_t>(0, until_us - bus_->NowUs())));
  } while (bus_->NowUs() < until_us);
  const std::string ended = processes_.Ended();
  return ended.empty() ? Status() : Fail(ErrorCode::kUnavailable, "station {}: {}", station_.name, ended);
}

}  // namespace forgescan
