#include "services/reconstruction/reconstruction_config.h"

#include <array>

namespace forgescan {
namespace {

struct Range {
  const char* name;
  double value;
  double low;
  double high;
};

}  // namespace

Status Check(const ReconstructionConfig& c) {
  const std::array ranges = {
      Range{"read_noise_dn", c.noise.read_noise_dn, 0, 50},
      Range{"gain_dn", c.noise.gain_dn, 0, 10},
      Range{"full_scale_16bit_dn", c.full_scale_16bit_dn, 255, 65535},
      Range{"saturation_fraction", c.saturation_fraction, 0.1, 1},
      Range{"min_modulation_dn", c.min_modulation_dn, 0.1, 127},
      Range{"min_modulation_sigma", c.min_modulation_sigma, 0, 1000},
      Range{"max_phase_sigma_rad", c.max_phase_sigma_rad, 1e-6, 1},
      Range{"modulation_ratio_tolerance", c.modulation_ratio_tolerance, 0, 100},
      Range{"reference_tolerance_sigma", c.reference_tolerance_sigma, 0, 1000},
      Range{"reference_tolerance_modulation", c.reference_tolerance_modulation, 0, 100},
      Range{"min_unwrap_margin_fraction", c.min_unwrap_margin_fraction, 0, 1},
      Range{"dead_margin_fraction", c.dead_margin_fraction, 0, 0.45},
      Range{"max_pixel_disagreement_rad", c.max_pixel_disagreement_rad, 0, 4},
      Range{"mask_border_px", static_cast<double>(c.mask_border_px), 0, 50},
      Range{"repair_min_neighbours", static_cast<double>(c.repair_min_neighbours), 1, 24},
      Range{"repair_tolerance_periods", c.repair_tolerance_periods, 0, 0.5},
      Range{"min_slope_ratio", c.min_slope_ratio, 0.001, 1},
      Range{"max_slope_ratio", c.max_slope_ratio, 1, 100},
      Range{"max_left_right_px", c.max_left_right_px, 0.001, 10},
      Range{"max_view_angle_deg", c.max_view_angle_deg, 1, 90},
      Range{"normal_radius_px", static_cast<double>(c.normal_radius_px), 1, 15},
      Range{"min_depth_mm", c.min_depth_mm, 1e-3, 1e6},
      Range{"max_depth_mm", c.max_depth_mm, c.min_depth_mm, 1e6},
      Range{"max_projector_residual_px", c.max_projector_residual_px, 0, 1000},
      Range{"max_projector_residual_sigma", c.max_projector_residual_sigma, 0, 1000},
      Range{"max_disagreement_rad", c.max_disagreement_rad, 0, 4},
      Range{"max_shared_second_harmonic", c.max_shared_second_harmonic, 0, 1},
      Range{"max_drift_phase_rad", c.max_drift_phase_rad, 0, 4},
      Range{"min_uncut_reference_fraction", c.min_uncut_reference_fraction, 0, 1},
      Range{"max_saturated_fraction", c.max_saturated_fraction, 0, 1},
      Range{"max_median_projector_residual_px", c.max_median_projector_residual_px, 0, 1000},
      Range{"max_column_rms_px", c.max_column_rms_px, 0, 1000},
      Range{"max_column_rms_sigma", c.max_column_rms_sigma, 0, 1000},
      Range{"max_parallax_ratio", c.max_parallax_ratio, 1, 1e9},
      Range{"min_matched_fraction", c.min_matched_fraction, 0, 1},
      Range{"min_points", static_cast<double>(c.min_points), 1, 1e9},
      Range{"keep_every_nth_point", static_cast<double>(c.keep_every_nth_point), 1, 1000},
      Range{"threads", static_cast<double>(c.threads), 1, 256},
  };
  for (const Range& range : ranges) {
    if (!(range.value >= range.low && range.value <= range.high)) {
      return Fail(ErrorCode::kInvalidArgument, "{} is {}, allowed {}..{}", range.name, range.value, range.low,
                  range.high);
    }
  }
  return {};
}

}  // namespace forgescan
