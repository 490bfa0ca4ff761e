#include "drivers/can/open_can_bus.h"
#include "drivers/line/line_canopen.h"
#include "drivers/robot/robot_canopen.h"
#include "services/common/service/run_service.h"
#include "services/robot/robot_service.h"

namespace forgescan {
namespace {

// Members end in reverse order: the service before its devices, the devices before their bus.
struct Running {
  std::unique_ptr<CanBus> can;
  std::unique_ptr<Robot> robot;
  std::unique_ptr<LineSignals> line;
  std::unique_ptr<RobotService> service;
};

Result<std::shared_ptr<void>> Make(const ServiceContext& context) {
  ASSIGN_OR_RETURN(const auto config, RobotConfig::Load(context.station.file.Table("robot")));
  auto running = std::make_shared<Running>();
  LcmBus& bus = context.bus;
  ASSIGN_OR_RETURN(running->can, OpenCanBus(context.station.can_url, [&bus] { return bus.NowUs(); }));
  running->robot = MakeCanRobot(*running->can);
  running->line = MakeCanLine(*running->can);
  running->service = std::make_unique<RobotService>(context.hub, context.monitor,
                                                    RobotService::Devices{*running->robot, *running->line},
                                                    config, context.station.folder + "/log/robot_parts.txt");
  bus.Watch(running->can->fd(), [running = running.get(), &monitor = context.monitor] {
    if (const Status drained = running->can->Drain(); !drained.ok()) {
      monitor.ReportError(drained.error());
    }
  });
  return std::shared_ptr<void>(running);
}

}  // namespace
}  // namespace forgescan

int main(int argc, char** argv) { return forgescan::RunService("robot", argc, argv, forgescan::Make); }
