#include "drivers/can/open_can_bus.h"
#include "drivers/cooling/cooling_canopen.h"
#include "services/common/service/run_service.h"
#include "services/cooling/cooling_service.h"

namespace forgescan {
namespace {

// Members end in reverse order: the service before its devices, the devices before their bus.
struct Running {
  std::unique_ptr<CanBus> can;
  std::unique_ptr<CoolingUnit> device;
  std::unique_ptr<CoolingService> service;
};

Result<std::shared_ptr<void>> Make(const ServiceContext& context) {
  ASSIGN_OR_RETURN(const auto config, CoolingConfig::Load(context.station.file.Table("cooling")));
  auto running = std::make_shared<Running>();
  LcmBus& bus = context.bus;
  ASSIGN_OR_RETURN(running->can, OpenCanBus(context.station.can_url, [&bus] { return bus.NowUs(); }));
  running->device = MakeCanCooling(*running->can);
  running->service = std::make_unique<CoolingService>(context.hub, context.monitor, *running->device, config);
  bus.Watch(running->can->fd(), [running = running.get(), &monitor = context.monitor] {
    if (const Status drained = running->can->Drain(); !drained.ok()) {
      monitor.ReportError(drained.error());
    }
  });
  return std::shared_ptr<void>(running);
}

}  // namespace
}  // namespace forgescan

int main(int argc, char** argv) { return forgescan::RunService("cooling", argc, argv, forgescan::Make); }
