#include <cstdio>
#include <string>

#include "drivers/camera/camera_aravis.h"
#include "services/camera/camera_service.h"
#include "services/common/service/run_service.h"

namespace forgescan {
namespace {

// Keeps the driver behind the service that uses it: members go in reverse order.
struct Running {
  CameraAravis camera;
  CameraService service;

  Running(const ServiceContext& context, const CameraAravisOptions& options, const CameraConfig& config,
          std::int8_t side)
      : camera(options), service(context.hub, context.monitor, camera, config, side) {}
};

Result<std::shared_ptr<void>> Make(const ServiceContext& context, const std::string& side) {
  ASSIGN_OR_RETURN(const CameraConfig config, CameraConfig::Load(context.station.file.Table("camera"), side));
  CameraAravisOptions options;
  options.address = config.address;
  options.width_px = config.width_px;
  options.height_px = config.height_px;
  options.exposure_us = config.exposure_us;
  options.packet_size_bytes = config.packet_size_bytes;
  options.heartbeat_timeout_ms = config.heartbeat_timeout_ms;
  options.packet_delay_ns = config.packet_delay_ns;
  RETURN_IF_ERROR(options.Check());
  const auto camera = side == "left" ? fsmsg::exposure_t::CAMERA_LEFT : fsmsg::exposure_t::CAMERA_RIGHT;
  const auto running = std::make_shared<Running>(context, options, config, camera);
  context.bus.Watch(running->camera.fd(), [running = running.get()] { running->camera.Dispatch(); });
  return std::shared_ptr<void>(running);
}

}  // namespace
}  // namespace forgescan

int main(int argc, char** argv) {
  const std::string side = argc > 1 ? argv[1] : "";
  if (side != "left" && side != "right") {
    std::fprintf(stderr, "usage: forgescan-camera left|right --station FOLDER\n");
    return 2;
  }
  return forgescan::RunService("camera_" + side, argc - 1, argv + 1,
                               [&side](const auto& context) { return forgescan::Make(context, side); });
}
