// Every threshold of the reconstruction, with its unit; the only home of their defaults.
#pragma once

#include "services/common/result.h"

namespace forgescan {

// One grey value I has the variance read_noise_dn^2 + gain_dn * I. DN: grey values of an 8-bit image (16-bit
// frames are scaled to 255 first). Defaults: an industrial 5 MP sensor with about 10,000 electrons full well.
struct CameraNoise {
  double read_noise_dn = 0.6;
  double gain_dn = 0.024;
};

// See docs/design.md, "The chain of measurement".
struct ReconstructionConfig {
  CameraNoise noise;
  double full_scale_16bit_dn = 65535;  // largest grey value of a 16-bit frame (4095 for 12-bit cameras)

  // A pixel is masked unless
  double saturation_fraction = 0.95;  // all its frames are below this part of full scale,
  double min_modulation_dn = 8;       // its smallest modulation B is above this
  double min_modulation_sigma = 5;    // and above so many sigma of a grey value,
  double max_phase_sigma_rad =
      0.05;  // the predicted sigma of its noisiest phase is below this: sigma / B of 0.04 for 3-2-2,
             // 0.07 for 4-4-4 frames; there wrong fringe orders are fewer than 1 in 100,000,
  double modulation_ratio_tolerance = 0.15;  // B of each frequency over B of the first is as expected,
  double reference_tolerance_sigma = 5;      // the reference frame is A + B / contrast within so many sigma
  double reference_tolerance_modulation = 0.05;  // or this part of B, whichever is more,
  double min_unwrap_margin_fraction =
      0.15;  // its fringe order beats the next best by this part of the set's separation,
  double dead_margin_fraction = 0.03;       // it is so far from an end of the field where fringe orders wrap,
  double max_pixel_disagreement_rad = 0.6;  // and its frequencies agree.
  int mask_border_px = 2;                   // Pixels so near to a masked one are dropped.

  int repair_min_neighbours = 6;  // of 24: valid pixels a low-margin pixel needs around it to be repaired
  double repair_tolerance_periods = 0.2;  // how near to their median it must come

  double min_slope_ratio = 0.3;  // projector px per camera px over the view's typical value
  double max_slope_ratio = 3.0;
  double max_left_right_px = 0.2;  // forward and backward correspondence must close within this
  double max_view_angle_deg = 70;  // between the normal and the view ray
  int normal_radius_px = 3;        // half the window a normal is fitted in
  double min_depth_mm = 50;
  double max_depth_mm = 10000;
  double max_projector_residual_px = 0.5;  // or so many sigma, whichever is more
  double max_projector_residual_sigma = 4;

  // A view is refused when
  double max_disagreement_rad =
      0.08;  // the frequencies disagree by more than this over the view (robust rms),
  double max_shared_second_harmonic =
      0.02;  // the projector's 2nd harmonic exceeds this and the background is shared,
  double max_drift_phase_rad = 0.05;  // a drift of the background bends a phase by more than this at worst,
                                      // and the background is shared; a contrast of the white frame that is 1
                                      // % off looks like 0.01 rad,
  double min_uncut_reference_fraction =
      0.5;  // less than this part of the lit pixels shows the reference frame not cut off, and the background
            // is shared: the median drift would be that of the rest,
  double max_saturated_fraction = 0.2;  // more than this part of the lit pixels is saturated,
  double max_median_projector_residual_px =
      0.2;                             // the projector disagrees by more than this: the calibration drifted,
  double max_column_rms_px = 0.12;     // no projector explains the columns of the points better than this,
  double max_column_rms_sigma = 1.0;   // both added as squares; sigma: of the left view's median coordinate,
  double max_parallax_ratio = 10;      // the cameras see so many times the relief the projector sees,
  double min_matched_fraction = 0.25;  // less than this part of the decoded pixels finds its partner
  int min_points = 1000;               // or fewer points remain.

  int keep_every_nth_point = 1;  // of the points of a row, beginning elsewhere in every row; all are checked

  int threads = 2;
};

// Errors: kInvalidArgument with the entry's name, value and allowed range.
Status Check(const ReconstructionConfig& config);

}  // namespace forgescan
