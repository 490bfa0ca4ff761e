// forgescan-recorder --station FOLDER
#include <csignal>
#include <filesystem>

#include "services/common/service/run_service.h"
#include "services/recorder/recorder_service.h"

namespace forgescan {
namespace {

Result<std::shared_ptr<void>> Make(const ServiceContext& context) {
  const Station& station = context.station;
  std::signal(SIGXFSZ, SIG_IGN);  // a limit on the size of files is an error of the write like any other
  ASSIGN_OR_RETURN(RecorderConfig config, RecorderConfig::Load(station.file.Table("recorder")));
  config.folder = (std::filesystem::path(station.folder) / config.folder).lexically_normal().string();
  ASSIGN_OR_RETURN(std::vector<StationFile> files, StationFilesOf(station));
  ASSIGN_OR_RETURN(auto service, RecorderService::Create(context.hub, context.monitor, config,
                                                         {station.name, FORGESCAN_VERSION, FORGESCAN_BUILD,
                                                          station.file.hash(), std::move(files)}));
  context.stop = [service = service.get(), &bus = context.bus] {
    service->FinishThen([&bus] { bus.Stop(); });
  };
  return std::shared_ptr<void>(std::move(service));
}

}  // namespace
}  // namespace forgescan

int main(int argc, char** argv) { return forgescan::RunService("recorder", argc, argv, forgescan::Make); }
