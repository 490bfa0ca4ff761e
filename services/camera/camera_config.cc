#include "services/camera/camera_config.h"

namespace forgescan {

Result<CameraConfig> CameraConfig::Load(ConfigTable table, const std::string& side) {
  CameraConfig config;
  for (const char* each :
       {"left", "right"}) {  // both are checked, so that no typing error waits for the other service
    std::string address;
    table.Table(each).Required("address", address);
    config.address = side == each ? address : config.address;
  }
  table.Required("width_px", config.width_px, 16, 10'000);
  table.Required("height_px", config.height_px, 16, 10'000);
  table.Required("exposure_us", config.exposure_us, 10, 1'000'000);
  table.Optional("packet_size_bytes", config.packet_size_bytes, 576, 16'000);
  table.Optional("packet_delay_ns", config.packet_delay_ns, 0, 1'000'000);
  table.Optional("frame_deadline_s", config.frame_deadline_s, 0.05, 60.0);
  table.Optional("view_timeout_s", config.view_timeout_s, 0.1, 600.0);
  table.Optional("reconnect_s", config.reconnect_s, 0.1, 60.0);
  table.Optional("heartbeat_timeout_ms", config.heartbeat_timeout_ms, 1600, 60'000);
  table.Optional("pairing_tolerance_us", config.pairing.tolerance_us, std::int64_t{1}, std::int64_t{10'000});
  table.Optional("pairing_drift_ppm", config.pairing.drift_ppm, 0.0, 1000.0);
  RETURN_IF_ERROR(table.Finish());
  RETURN_IF_ERROR(config.pairing.Check());
  return config;
}

}  // namespace forgescan
