// Configuration of a camera service: table [camera] of station.toml, with [camera.left] and [camera.right].
#pragma once

#include <string>

#include "services/camera/frame_pairing.h"
#include "services/common/config/config.h"

namespace forgescan {

struct CameraConfig {
  std::string address;  // of this camera, IPv4
  int width_px = 2448;
  int height_px = 2048;
  int exposure_us = 12'000;      // as the trigger service orders it; every frame is checked against it
  int packet_size_bytes = 9000;  // IP packet
  int packet_delay_ns = 0;
  double frame_deadline_s = 1.0;    // from an exposure record to its frame: exposure, wire time and resends
  double view_timeout_s = 15.0;     // from the end of a view to its last exposure record
  double reconnect_s = 0.2;         // between two attempts to reach the camera
  int heartbeat_timeout_ms = 1600;  // the camera obeys another host once this one is silent for so long
  FramePairingOptions pairing;

  // side: "left" or "right".
  static Result<CameraConfig> Load(ConfigTable table, const std::string& side);
};

}  // namespace forgescan
