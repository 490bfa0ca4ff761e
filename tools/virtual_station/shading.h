// How bright a surface point is under the projector.
#pragma once

#include <Eigen/Geometry>

#include "tools/virtual_station/cell_config.h"

namespace forgescan {

// What a camera pixel sees of one surface point. Grey value = lit * pattern(u) + base, in DN before noise.
struct SurfaceSample {
  float u_px = 0.0f;  // projector coordinate; meaningless where lit is 0
  float lit = 0.0f;   // DN under white light; 0 in shadow or outside the projected field
  float base = 0.0f;  // DN without the projector: dark level, ambient light, glow
};

enum class Surface : std::uint8_t { kNone = 0, kPart = 1, kCell = 2 };

// A surface point as the light meets it; all in the array frame, directions of length 1.
struct LightPath {
  Eigen::Vector3d point, normal, to_camera, to_projector;
  double projector_distance_mm;
};

struct ShadingSettings {
  SensorConfig sensor;
  SurfaceConfig surface;
  double working_distance_mm = 0.0;
  double exposure = 1.0;
  double part_temperature_degc = 0.0;
  std::uint64_t texture_seed = 0;
  Eigen::Isometry3d part_from_array =
      Eigen::Isometry3d::Identity();  // so that the scale texture stays on the part
};

class Shader {
 public:
  explicit Shader(const ShadingSettings& settings);

  // White light in DN, without regard to shadow.
  double Lit(Surface surface, const LightPath& path) const;
  double Base(Surface surface, const Eigen::Vector3d& p_in_array) const;

 private:
  double Albedo(Surface surface, const Eigen::Vector3d& p_in_array) const;

  ShadingSettings settings_;
  double glow_dn_;
};

}  // namespace forgescan
