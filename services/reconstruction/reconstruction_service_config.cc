#include "services/reconstruction/reconstruction_service.h"

namespace forgescan {

Result<ReconstructionServiceConfig> ReconstructionServiceConfig::Load(ConfigTable table) {
  ReconstructionServiceConfig config;
  ReconstructionConfig& core = config.reconstruction;
  table.Required("read_noise_dn", core.noise.read_noise_dn, 0.0, 50.0);
  table.Required("gain_dn", core.noise.gain_dn, 0.0, 1.0);
  table.Optional("saturation_fraction", core.saturation_fraction, 0.5, 1.0);
  table.Optional("min_modulation_dn", core.min_modulation_dn, 0.0, 127.0);
  table.Optional("max_phase_sigma_rad", core.max_phase_sigma_rad, 0.001, 0.5);
  table.Optional("modulation_ratio_tolerance", core.modulation_ratio_tolerance, 0.01, 1.0);
  table.Optional("max_shared_second_harmonic", core.max_shared_second_harmonic, 0.001, 0.2);
  table.Optional("max_disagreement_rad", core.max_disagreement_rad, 0.01, 1.0);
  table.Optional("max_view_angle_deg", core.max_view_angle_deg, 10.0, 89.0);
  table.Optional("min_depth_mm", core.min_depth_mm, 1.0, 10'000.0);
  table.Optional("max_depth_mm", core.max_depth_mm, 1.0, 10'000.0);
  table.Optional("min_points", core.min_points, 1, 10'000'000);
  table.Optional("threads", core.threads, 1, 64);
  table.Optional("publish_every_nth_point", config.publish_every_nth_point, 1, 1000);
  table.Optional("frame_timeout_s", config.frame_timeout_s, 1.0, 600.0);
  RETURN_IF_ERROR(table.Finish());
  RETURN_IF_ERROR(Check(core));
  return config;
}

}  // namespace forgescan
