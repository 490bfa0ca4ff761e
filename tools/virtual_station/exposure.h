// From what a pixel sees to the grey value the camera sends.
#pragma once

#include <cstdint>
#include <vector>

#include "tools/virtual_station/geometry_map.h"
#include "tools/virtual_station/pattern.h"

namespace forgescan {

// Which image it is; noise depends on nothing else.
struct ImageKey {
  std::uint64_t seed = 0;
  int part = 0, view = 0;
  int visit = 0;  // of the view: one that is taken again is another image
  Side side = Side::kLeft;
  int pattern = 0;  // index in the order of projection
};

struct ExposureRequest {
  const ProjectorLightConfig& light;
  const SensorConfig& sensor;
  Pattern pattern;
  ImageKey key;
  int threads = 1;
};

// Shape: map.width * map.height, 8 bit, row-major; the same bytes for any number of threads.
// grey = clamp(round(lit * level(u) + base + noise)), noise^2 = read^2 + gain * signal.
std::vector<std::uint8_t> ExposeImage(const GeometryMap& map, const ExposureRequest& request);

}  // namespace forgescan
